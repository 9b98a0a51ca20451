// Writes the format `obj`: an OBJ file a frame with all digits of the positions, and one library of
// materials. A body that was made of an OBJ file is written as that file, with other positions.
#include <map>
#include <set>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/base/printable.h"
#include "sim/io/export/description.h"
#include "sim/io/export/exporters.h"
#include "sim/io/export/own_mesh.h"
#include "sim/io/export/own_obj.h"

namespace duet::io {
namespace {

// Gives out names of materials: those of the looks, and those that the user's files name. A name from a
// file stands for the look of its body, and gets a number if it is taken.
class Materials {
 public:
  explicit Materials(const ExportedRun& run)
      : of_looks_(material_names(run)), taken_(of_looks_.begin(), of_looks_.end()) {}

  // Returns the material to write for `usemtl name` in a body of this look. An empty name gives the
  // material of the look. The result is empty if the run has no looks.
  std::string of(const std::string& name, int look) {
    if (of_looks_.empty()) return {};
    if (name.empty()) return of_looks_.at(static_cast<std::size_t>(look));
    const auto [known, is_new] = names_.try_emplace({name, look});
    if (is_new) {
      known->second = name;
      for (int next = 2; !taken_.insert(known->second).second; ++next)
        known->second = fmt::format("{}-{}", name, next);
      more_.emplace_back(known->second, look);
    }
    return known->second;
  }
  // Returns true if the run has no looks.
  bool is_empty() const { return of_looks_.empty(); }
  // Returns the names from the user's files, each with the index of its look.
  const std::vector<std::pair<std::string, int>>& more() const { return more_; }

 private:
  const std::vector<std::string> of_looks_;
  std::set<std::string> taken_;
  std::map<std::pair<std::string, int>, std::string> names_;
  std::vector<std::pair<std::string, int>> more_;
};

// A body that is written as the OBJ file that it was made of.
struct OwnBody {
  std::size_t index;       // index in ExportedRun::bodies()
  std::vector<int> order;  // OwnMesh::positions
  OwnObj obj;
  Surface surface;  // surface at the present frame
};

// Contents of the files. The bodies that are not written as files of the user come first.
struct Sequence {
  std::vector<std::size_t> plain;     // indices of these bodies in ExportedRun::bodies()
  std::vector<BodySurface> surfaces;  // surfaces of these bodies at the present frame
  std::vector<OwnBody> own;
  ObjStyle style;
  ExportNotes notes;
};

Sequence make_sequence(const ExportedRun& run, Materials& materials) {
  Sequence sequence;
  sequence.style.comment =
      fmt::format("{} units a meter; {} up, right-handed; one object a body, constant vertex order",
                  run.scale(), run.up());
  if (!materials.is_empty()) sequence.style.library = "materials.mtl";
  std::vector<std::optional<OwnMesh>> own = own_meshes(run);
  sequence.notes = notes_on_own_meshes(run, own);
  int vertices = 0, uvs = 0;
  for (std::size_t i = 0; i < own.size(); ++i) {
    if (own[i]) continue;
    const ExportedBody& body = run.bodies()[i];
    sequence.plain.push_back(i);
    sequence.surfaces.push_back({printable_line(body.name), body.rest});
    if (!materials.is_empty()) sequence.style.materials.push_back(materials.of("", body.look));
    vertices += static_cast<int>(body.rest.positions.size());
    uvs += static_cast<int>(body.rest.uvs.size());
  }
  for (std::size_t i = 0; i < own.size(); ++i) {
    if (!own[i]) continue;
    const ExportedBody& body = run.bodies()[i];
    const std::function<std::string(const std::string&)> material = [&](const std::string& name) {
      return materials.of(printable_line(name), body.look);
    };
    OwnObj obj(obj_statements(read_file(own[i]->file)), printable_line(body.name), vertices, uvs, material);
    vertices += obj.vertices();
    uvs += obj.uvs();
    if (const int damaged = obj.damaged_faces(); damaged > 0)
      sequence.notes.push_back(fmt::format(
          "{} of the OBJ file of `{}` {} vertices or texture coordinates that the file does not have, and {} "
          "left out or written without texture coordinates",
          damaged == 1 ? "a face" : fmt::format("{} faces", damaged), printable_line(body.name),
          damaged == 1 ? "names" : "name", damaged == 1 ? "is" : "are"));
    sequence.own.push_back({i, std::move(own[i]->positions), std::move(obj), body.rest});
  }
  return sequence;
}

}  // namespace

ExportNotes export_obj(const ExportedRun& run, const FormatOptions&, const fs::path& folder) {
  Materials materials(run);
  Sequence sequence = make_sequence(run, materials);
  if (!materials.is_empty()) write_materials(run, folder / sequence.style.library, materials.more());
  write_json(description(run, "obj"), folder / "export.json");
  TextBuilder own_text;
  for (const int frame : run.frames()) {
    const FrameValues values = run.read(frame);
    for (std::size_t i = 0; i < sequence.plain.size(); ++i)
      place(run.bodies()[sequence.plain[i]], values, sequence.surfaces[i].surface);
    own_text.clear();
    for (OwnBody& own : sequence.own) {
      place(run.bodies()[own.index], values, own.surface);
      own.obj.add(own_text, own.surface.positions, own.order);
    }
    OutputFile file(folder / fmt::format("{:04}.obj", frame));
    file.write(obj_text(sequence.surfaces, sequence.style));
    file.write(own_text.view());
    file.close();
  }
  ExportNotes notes = notes_on_looks(run);
  notes.insert(notes.end(), sequence.notes.begin(), sequence.notes.end());
  if (!sequence.own.empty())
    notes.push_back(fmt::format(
        "{} bod{} written as the OBJ files that the scene names, without normals, which would be those "
        "of the files",
        sequence.own.size(), sequence.own.size() == 1 ? "y is" : "ies are"));
  return notes;
}

}  // namespace duet::io
