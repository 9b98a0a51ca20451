// Writes a USD stage in a folder: run.usda, and a file a frame if the bodies have many values. The stage
// reads these files as value clips, so that neither writer nor readers have to hold more than a frame.
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
  using Texts = std::array<std::string, usd_attribute_count>;

  void read_frames();
  void write_frame(int frame, const std::vector<Texts>& values);
  void write_clip_manifest();
  void write_root();
  void write_deformable(OutputFile& out, std::size_t deformable);
  void write_file(const fs::path& path, const std::string& text);
  // Returns a layer of overrides for the prims of bodies that move. rigid(body) returns the lines of the
  // transform of a rigid body, deformable(index, attribute) an attribute of a deformable body, whose index
  // counts deformable bodies alone; an empty text leaves it out.
  template <class Rigid, class Deformable>
  std::string overs(Rigid&& rigid, Deformable&& deformable) const;
  std::string head() const;
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

std::string frame_file(int frame) { return fmt::format("frames/{:04}.usda", frame); }

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
  has_clips_ = bytes > max_inline_bytes && frames > 1;
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
    std::vector<Texts> texts;
    for (UsdDeformable& body : deformables_) texts.push_back(body.at(values));
    for (std::size_t k = 0; k < usd_attribute_count && !texts.empty(); ++k)
      is_there_[k] = is_there_[k] || !texts.front()[k].empty();
    if (has_clips_) {
      write_frame(frame, texts);
      continue;
    }
    for (std::size_t i = 0; i < texts.size(); ++i)
      for (std::size_t k = 0; k < usd_attribute_count; ++k)
        if (!texts[i][k].empty()) samples_[i][k].add(frame, std::move(texts[i][k]));
  }
}

template <class Rigid, class Deformable>
std::string UsdStage::overs(Rigid&& rigid, Deformable&& deformable) const {
  std::string text = "#usda 1.0\n\nover \"run\"\n{\n    over \"bodies\"\n    {\n";
  std::size_t next = 0;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    const ExportedBody& body = run_.bodies()[i];
    if (is_still(body)) continue;
    text += fmt::format("        over \"{}\"\n        {{\n", names_[i]);
    if (body.is_rigid()) {
      text += rigid(i) + "        }\n";
      continue;
    }
    text += fmt::format("{0}{1}\n\n{0}over \"mesh\"\n{0}{{\n", body_indent,
                        deformable(next, static_cast<std::size_t>(UsdValue::translate)));
    for (std::size_t k = 1; k < usd_attribute_count; ++k)
      if (const std::string line = deformable(next, k); !line.empty()) text += mesh_indent + line + "\n";
    text += body_indent + "}\n        }\n";
    ++next;
  }
  return text + "    }\n}\n";
}

void UsdStage::write_frame(int frame, const std::vector<Texts>& values) {
  const auto sample = [&](const std::string& declaration, const std::string& value) {
    return fmt::format("{}.timeSamples = {{ {}: {} }}", declaration, frame, value);
  };
  const auto rigid = [&](std::size_t body) {
    const PoseTrack& track = poses_.of(body);
    return body_indent + sample(usd_translate, usd_tuple(track.positions.back())) + "\n" + body_indent +
           sample(usd_orient, usd_tuple(track.orientations.back())) + "\n";
  };
  write_file(folder_ / frame_file(frame), overs(rigid, [&](std::size_t i, std::size_t k) {
               return values[i][k].empty() ? std::string() : sample(usd_declaration(k), values[i][k]);
             }));
}

// Returns the lines that declare the attributes of a transform. They have no values, which would hide those
// of the clips.
std::string declared_transform() {
  return fmt::format("{0}{1}\n{0}{2}\n", body_indent, usd_translate, usd_orient);
}

void UsdStage::write_clip_manifest() {
  write_file(
      folder_ / "frames" / "manifest.usda",
      overs([](std::size_t) { return declared_transform(); },
            [&](std::size_t, std::size_t k) { return is_there_[k] ? usd_declaration(k) : std::string(); }));
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
  put(out, head());
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

std::string UsdStage::head() const {
  const Manifest& manifest = run_.manifest();
  return fmt::format(
      "#usda 1.0\n(\n    customLayerData = {{\n        string generator = {}\n"
      "        string title = {}\n        int[] missingFrames = {}\n    }}\n"
      "    defaultPrim = \"run\"\n    endTimeCode = {}\n    framesPerSecond = {}\n"
      "    metersPerUnit = {}\n    startTimeCode = {}\n    timeCodesPerSecond = {}\n"
      "    upAxis = \"{}\"\n)\n\n",
      usd_string(program_text(manifest.origin)), usd_string(manifest.title), usd_array(run_.missing()),
      run_.frames().back(), manifest.fps, 1 / run_.scale(), run_.frames().front(), manifest.fps,
      run_.up() == 'z' ? 'Z' : 'Y');
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

// Returns the beginning of the body's mesh, up to the attributes that are its own.
std::string UsdStage::mesh_start(std::size_t body) const {
  const ExportedBody& exported = run_.bodies()[body];
  const auto material = materials_.find(exported.look);
  const bool has_material = material != materials_.end();
  std::string text = "\n" + body_indent + "def Mesh \"mesh\" (\n";
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
  add(fmt::format("double2[] times = [({0}, {0}), ({1}, {1})]", run_.frames().front(), run_.frames().back()));
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

ExportNotes notes_of(const ExportedRun& run, const FormatOptions& options) {
  ExportNotes notes;
  if (options.compress)
    notes.emplace_back(
        "usd is written as text: --compress changes nothing (usdcat, which comes with USD, makes "
        "binary .usdc files of it)");
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
  return notes_of(run, options);
}

ExportNotes export_usd(const ExportedRun& run, const FormatOptions& options, const fs::path& folder) {
  return export_usd(run, options, folder, usd_max_inline_bytes);
}

}  // namespace duet::io
