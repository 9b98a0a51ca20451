// `obj`: an OBJ file a frame with all digits of the positions, and one library of materials.
#include <fmt/format.h>

#include "sim/base/printable.h"
#include "sim/io/export/description.h"
#include "sim/io/export/exporters.h"

namespace duet::io {

ExportNotes export_obj(const ExportedRun& run, const FormatOptions&, const fs::path& folder) {
  ObjStyle style;
  style.comment =
      fmt::format("{} units a meter; {} up, right-handed; one object a body, constant vertex order",
                  run.scale(), run.up());
  std::vector<BodySurface> surfaces;
  const std::vector<std::string> materials = material_names(run);
  if (!materials.empty()) style.library = "materials.mtl";
  for (const ExportedBody& body : run.bodies()) {
    surfaces.push_back({printable_line(body.name), body.rest});
    if (!materials.empty()) style.materials.push_back(materials.at(static_cast<std::size_t>(body.look)));
  }
  if (!materials.empty()) write_materials(run, folder / style.library);
  write_json(description(run, "obj"), folder / "export.json");
  for (const int frame : run.frames()) {
    const FrameValues values = run.read(frame);
    for (std::size_t i = 0; i < surfaces.size(); ++i) place(run.bodies()[i], values, surfaces[i].surface);
    OutputFile file(folder / fmt::format("{:04}.obj", frame));
    file.write(obj_text(surfaces, style));
    file.close();
  }
  return notes_on_looks(run);
}

}  // namespace duet::io
