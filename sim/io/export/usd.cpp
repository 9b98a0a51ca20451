// Writes a USD stage in a folder: run.usda, and a binary file a frame if the bodies have many values. The
// stage reads these files as value clips, so that neither writer nor readers have to hold more than a frame.
#include "sim/io/export/usd.h"

#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/io/export/usd_bodies.h"
#include "sim/io/export/usd_shading.h"

namespace duet::io {
namespace {

// Paths of prims in the stage.
constexpr const char* bodies_path = "/run/bodies";
constexpr const char* materials_path = "/run/materials";
const std::string body_indent(12, ' '), mesh_indent(16, ' ');

// The stage of a run.
class UsdStage {
 public:
  UsdStage(const ExportedRun& run, const FormatOptions& options, const fs::path& folder,
           std::uint64_t max_inline_bytes);

  // Reads all frames and writes all files.
  void write();

 private:
  // Values of a deformable body at a frame, by the number of the attribute.
  using Values = std::array<UsdData, usd_attribute_count>;

  void read_frames();
  void write_frame(int frame, const std::vector<Values>& values);
  void write_clip_manifest();
  void write_root();
  void write_deformable(OutputFile& out, std::size_t deformable);
  void write_file(const fs::path& path, const std::string& text);
  std::string shape(std::size_t body) const;
  std::string rigid_body(std::size_t body) const;
  std::string body_start(std::size_t body) const;
  std::string mesh_start(std::size_t body) const;
  std::string materials() const;
  std::string lights() const;
  std::string clips() const;
  void put(OutputFile& out, const std::string& text);

  const ExportedRun& run_;
  const std::uint64_t max_bytes_;
  const fs::path folder_;
  const std::vector<std::size_t> first_same_;  // result of first_with_same_surface()
  PoseTracks poses_;
  std::vector<std::string> names_;        // identifiers of the bodies
  std::map<int, std::string> materials_;  // identifiers of the looks of the bodies, by index of the look
  std::vector<UsdDeformable> deformables_;
  std::vector<std::size_t> deformable_bodies_;  // index of each of deformables_ in ExportedRun::bodies()
  std::vector<std::array<UsdSamples, usd_attribute_count>> samples_;  // of deformables_; empty with clips
  std::array<bool, usd_attribute_count> is_there_{};  // for each attribute whether a frame has had it
  bool has_clips_ = false;                            // true if values are in a file a frame
  std::uint64_t bytes_ = 0;                           // bytes written so far
};

bool is_still(const ExportedBody& body) { return body.kind == "static"; }

std::string frame_file(int frame) { return fmt::format("frames/{:04}.usdc", frame); }

UsdStage::UsdStage(const ExportedRun& run, const FormatOptions& options, const fs::path& folder,
                   std::uint64_t max_inline_bytes)
    : run_(run),
      max_bytes_(options.max_bytes),
      folder_(folder),
      first_same_(first_with_same_surface(run.bodies())),
      poses_(run) {
  UsdNames bodies, looks;
  const std::uint64_t frames = run.frames().size();
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < run.bodies().size(); ++i) {
    const ExportedBody& body = run.bodies()[i];
    names_.push_back(bodies.take(body.name));
    if (!run.looks().looks.empty() && !materials_.contains(body.look))
      materials_[body.look] = looks.take(run.looks().looks.at(static_cast<std::size_t>(body.look)).name);
    if (!is_still(body)) bytes += frames * usd_frame_bytes(body);
    if (body.is_rigid()) continue;
    deformables_.emplace_back(body);
    deformable_bodies_.push_back(i);
  }
  samples_.resize(deformables_.size());
  has_clips_ = bytes > 0 && (options.compress || (bytes > max_inline_bytes && frames > 1));
}

void UsdStage::write() {
  read_frames();
  if (has_clips_) write_clip_manifest();
  write_root();
}

void UsdStage::read_frames() {
  if (has_clips_) create_folder(folder_ / "frames");
  for (const int frame : run_.frames()) {
    const FrameValues values = run_.read(frame);
    poses_.add(values);
    std::vector<Values> data;
    data.reserve(deformables_.size());
    for (UsdDeformable& body : deformables_) data.push_back(body.at(values));
    for (std::size_t k = 0; k < usd_attribute_count && !data.empty(); ++k)
      is_there_[k] = is_there_[k] || !std::holds_alternative<std::monostate>(data.front()[k]);
    if (has_clips_) {
      write_frame(frame, data);
      continue;
    }
    for (std::size_t i = 0; i < data.size(); ++i)
      for (std::size_t k = 0; k < usd_attribute_count; ++k)
        if (std::string text = usd_value_text(k, data[i][k]); !text.empty())
          samples_[i][k].add(frame, std::move(text));
  }
}

// Writes the file of a frame: overrides for the prims of the bodies that move.
void UsdStage::write_frame(int frame, const std::vector<Values>& values) {
  constexpr auto translate = static_cast<std::size_t>(UsdValue::translate);
  UsdCrate layer(frame);
  layer.begin_prim("run");
  layer.begin_prim("bodies");
  std::size_t next = 0;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    const ExportedBody& body = run_.bodies()[i];
    if (is_still(body)) continue;
    layer.begin_prim(names_[i]);
    if (body.is_rigid()) {
      const PoseTrack& track = poses_.of(i);
      layer.add(usd_translate, track.positions.back());
      layer.add(usd_orient, track.orientations.back());
    } else {
      const Values& of_body = values[next++];
      layer.add(usd_declaration(translate), of_body[translate]);
      layer.begin_prim(names_[i]);
      for (std::size_t k = translate + 1; k < usd_attribute_count; ++k)
        layer.add(usd_declaration(k), of_body[k]);
      layer.end_prim();
    }
    layer.end_prim();
  }
  layer.end_prim();
  layer.end_prim();
  write_file(folder_ / frame_file(frame), layer.finish());
}

// Returns the lines that declare the attributes of a transform. They have no values, which would hide those
// of the clips.
std::string declared_transform() {
  return fmt::format("{0}{1}\n{0}{2}\n", body_indent, usd_translate, usd_orient);
}

// Writes the manifest of the value clips: declarations of all attributes that their files have.
void UsdStage::write_clip_manifest() {
  constexpr auto translate = static_cast<std::size_t>(UsdValue::translate);
  std::string text = "#usda 1.0\n\nover \"run\"\n{\n    over \"bodies\"\n    {\n";
  for (std::size_t i = 0; i < names_.size(); ++i) {
    const ExportedBody& body = run_.bodies()[i];
    if (is_still(body)) continue;
    text += fmt::format("        over \"{}\"\n        {{\n", names_[i]);
    if (body.is_rigid()) {
      text += declared_transform() + "        }\n";
      continue;
    }
    text +=
        fmt::format("{0}{1}\n\n{0}over \"{2}\"\n{0}{{\n", body_indent, usd_declaration(translate), names_[i]);
    for (std::size_t k = translate + 1; k < usd_attribute_count; ++k)
      if (is_there_[k]) text += mesh_indent + usd_declaration(k) + "\n";
    text += body_indent + "}\n        }\n";
  }
  write_file(folder_ / "frames" / "manifest.usda", text + "    }\n}\n");
}

void UsdStage::write_file(const fs::path& path, const std::string& text) {
  OutputFile out(path);
  put(out, text);
  out.close();
}

void UsdStage::put(OutputFile& out, const std::string& text) {
  bytes_ += text.size();
  if (max_bytes_ > 0 && bytes_ > max_bytes_)
    throw Error(
        ExitStatus::usage,
        fmt::format("the USD stage has more than the {:g} MB that are allowed (export fewer --frames or "
                    "--bodies)",
                    1e-6 * static_cast<double>(max_bytes_)));
  out.write(text);
}

void UsdStage::write_root() {
  OutputFile out(folder_ / "run.usda");
  put(out, usd_stage_head(run_));
  put(out, "class Scope \"shapes\"\n{\n");
  for (std::size_t i = 0; i < names_.size(); ++i)
    if (run_.bodies()[i].is_rigid() && first_same_[i] == i) put(out, shape(i));
  put(out, "}\n\ndef Xform \"run\"\n{\n    def Xform \"bodies\"");
  put(out, (has_clips_ ? " (\n" + clips() + "    )" : std::string()) + "\n    {\n");
  for (std::size_t i = 0; i < names_.size(); ++i)
    if (run_.bodies()[i].is_rigid()) put(out, rigid_body(i));
  for (std::size_t i = 0; i < deformables_.size(); ++i) write_deformable(out, i);
  put(out, "    }\n" + materials() + lights());
  put(out, usd_camera(camera_track(run_, poses_.times()), run_) + "}\n");
  out.close();
}

// Returns the mesh in /shapes to which all rigid bodies with the surface of this one refer.
std::string UsdStage::shape(std::size_t body) const {
  const Surface& surface = run_.bodies()[body].rest;
  const std::string indent(8, ' ');
  return fmt::format("    def Mesh \"{}\"\n    {{\n{}{}    }}\n", names_[body],
                     usd_rest_shape(surface, indent), usd_topology(surface, indent));
}

// Returns the beginning of the body's prim, up to its attributes.
std::string UsdStage::body_start(std::size_t body) const {
  const std::string& name = run_.bodies()[body].name;
  std::string display = usd_display_name(name, names_[body]);
  if (!display.empty()) display = body_indent + display + "\n";
  return fmt::format(
      "        def Xform \"{}\" (\n{}{}customData = {{\n{}    string kind = \"{}\"\n{}}}\n"
      "        )\n        {{\n",
      names_[body], display, body_indent, body_indent, run_.bodies()[body].kind, body_indent);
}

// Returns the beginning of the body's mesh, up to the attributes that are its own. It has the name of the
// body's prim, because Blender makes one object of both and gives it the name of the mesh.
std::string UsdStage::mesh_start(std::size_t body) const {
  const ExportedBody& exported = run_.bodies()[body];
  const auto material = materials_.find(exported.look);
  const bool has_material = material != materials_.end();
  std::string text = fmt::format("\n{}def Mesh \"{}\" (\n", body_indent, names_[body]);
  if (has_material) text += mesh_indent + "prepend apiSchemas = [\"MaterialBindingAPI\"]\n";
  if (exported.is_rigid())
    text += fmt::format("{}prepend references = </shapes/{}>\n", mesh_indent, names_[first_same_[body]]);
  text += body_indent + ")\n" + body_indent + "{\n";
  if (has_material)
    text += fmt::format("{}rel material:binding = <{}/{}>\n", mesh_indent, materials_path, material->second);
  return text;
}

std::string UsdStage::rigid_body(std::size_t body) const {
  const bool has_clip = has_clips_ && !is_still(run_.bodies()[body]);
  const std::string transform = has_clip ? declared_transform() + body_indent + usd_transform_order
                                         : usd_transform(body_indent, run_.frames(), poses_.of(body));
  return body_start(body) + transform + mesh_start(body) + body_indent + "}\n        }\n\n";
}

void UsdStage::write_deformable(OutputFile& out, std::size_t deformable) {
  const std::size_t body = deformable_bodies_[deformable];
  const Surface& surface = run_.bodies()[body].rest;
  const auto put_attribute = [&](std::size_t k, const std::string& indent) {
    // With clips the attribute is declared without a value, which would hide those of the clips.
    UsdSamples& samples = samples_[deformable][k];
    if (is_there_[k])
      put(out, has_clips_ ? fmt::format("{}{}\n", indent, usd_declaration(k))
                          : samples.text(indent, usd_declaration(k)));
    samples = {};
  };
  put(out, body_start(body));
  put_attribute(static_cast<std::size_t>(UsdValue::translate), body_indent);
  put(out, body_indent + "uniform token[] xformOpOrder = [\"xformOp:translate\"]\n" + mesh_start(body));
  for (std::size_t k = 1; k < usd_attribute_count; ++k) put_attribute(k, mesh_indent);
  for (std::size_t k = 1; k < usd_attribute_count; ++k)
    if (const std::string metadata = usd_metadata(k, surface); is_there_[k] && !metadata.empty())
      put(out, fmt::format("{}{}{}\n", mesh_indent, usd_declaration(k), metadata));
  put(out, usd_topology(surface, mesh_indent) + body_indent + "}\n        }\n\n");
}

// Returns the metadata of the value clips: the file of each frame is active from its frame on.
std::string UsdStage::clips() const {
  std::vector<std::string> files, active;
  for (const int frame : run_.frames()) {
    active.push_back(fmt::format("({}, {})", frame, files.size()));
    files.push_back("@./" + frame_file(frame) + "@");
  }
  std::string text = "        clips = {\n            dictionary default = {\n";
  const auto add = [&](const std::string& line) { text += mesh_indent + line + "\n"; };
  add(fmt::format("double2[] active = [{}]", fmt::join(active, ", ")));
  add(fmt::format("asset[] assetPaths = [{}]", fmt::join(files, ", ")));
  add("asset manifestAssetPath = @./frames/manifest.usda@");
  add(fmt::format("string primPath = \"{}\"", bodies_path));
  const int first = run_.frames().front(), last = run_.frames().back();
  add(first == last ? fmt::format("double2[] times = [({0}, {0})]", first)
                    : fmt::format("double2[] times = [({0}, {0}), ({1}, {1})]", first, last));
  return text + "            }\n        }\n";
}

std::string UsdStage::materials() const {
  if (materials_.empty()) return {};
  std::string text = "\n    def Scope \"materials\"\n    {\n";
  for (const auto& [look, name] : materials_)
    text += usd_material(run_.looks().looks[static_cast<std::size_t>(look)], name, materials_path);
  return text + "    }\n";
}

std::string UsdStage::lights() const {
  if (run_.looks().lights.empty()) return {};
  UsdNames names;
  std::string text = "\n    def Xform \"lights\"\n    {\n";
  for (const scene::Light& light : run_.looks().lights)
    text += usd_light(light, names.take(light.name), run_);
  return text + "    }\n";
}

bool is_patterned(const scene::Look& look) { return !look.pattern.empty() || !look.spots.empty(); }

ExportNotes notes_of(const ExportedRun& run) {
  ExportNotes notes;
  if (!run.missing().empty())
    notes.push_back(
        fmt::format("{} frames are missing (the first is {})", run.missing().size(), run.missing().front()));
  const std::vector<scene::Look>& looks = run.looks().looks;
  if (!looks.empty() && std::any_of(run.bodies().begin(), run.bodies().end(), [&](const ExportedBody& body) {
        return is_patterned(looks.at(static_cast<std::size_t>(body.look)));
      }))
    notes.emplace_back("materials have the first color of a look, without its pattern and spots");
  return notes;
}

}  // namespace

ExportNotes export_usd(const ExportedRun& run, const FormatOptions& options, const fs::path& folder,
                       std::uint64_t max_inline_bytes) {
  UsdStage stage(run, options, folder, max_inline_bytes);
  stage.write();
  return notes_of(run);
}

ExportNotes export_usd(const ExportedRun& run, const FormatOptions& options, const fs::path& folder) {
  return export_usd(run, options, folder, usd_max_inline_bytes);
}

}  // namespace duet::io
