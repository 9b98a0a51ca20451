// `duet export`: writes a run in the formats of other programs.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "tools/commands.h"
#include "tools/export_blend.h"
#include "tools/exported_looks.h"
#include "tools/interrupt.h"
#include "tools/scene_files.h"
#include "tools/wording.h"
#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/base/near_miss.h"
#include "sim/base/wording.h"
#include "sim/io/export/description.h"
#include "sim/io/export/exporters.h"
#include "sim/io/run_check.h"
#include "sim/io/run_folder.h"
#include "sim/scene/reader/reader.h"

namespace duet::tools {
namespace {
namespace fs = std::filesystem;

// A format and the function that writes it.
struct Format {
  const char* name;
  const char* ending;            // extension of its single file; null: it writes a folder
  bool can_compress, has_bound;  // accepts --compress; accepts --max-size
  bool is_of_whole_run;          // takes no --frames, --bodies, --up and --scale, and has the ground
  io::ExportNotes (*write)(const io::ExportedRun&, const io::FormatOptions&, const fs::path&);
  const char* what;  // description for --help
};

constexpr std::array formats = std::to_array<Format>({
    {"transforms", nullptr, false, false, false, io::export_transforms,
     "poses and velocities of rigid bodies, JSON and CSV"},
    {"obj", nullptr, false, false, false, io::export_obj, "a Wavefront OBJ file a frame, with materials"},
    {"ply", nullptr, false, false, false, io::export_ply,
     "a binary PLY file a frame, with velocities, strain, stress and contact"},
    {"pc2", nullptr, false, false, false, io::export_pc2,
     "a point cache and a mesh a body: Blender, 3ds Max"},
    {"mdd", nullptr, false, false, false, io::export_mdd,
     "a point cache and a mesh a body: LightWave, Blender, Houdini"},
    {"glb", "glb", false, true, false, io::export_glb,
     "one animated glTF file with materials, camera and lights: the web, Blender"},
    {"usd", nullptr, true, true, false, io::export_usd,
     "a USD stage, with binary files of the frames: Houdini, Blender, usdview"},
    {"blend", "blend", false, false, true, export_blend,
     "a Blender scene, which Blender makes where it is installed"},
    {"vtk", nullptr, true, false, false, io::export_vtk,
     "VTK poly data with velocity, displacement, strain, stress and contact: ParaView"},
    {"vdb", nullptr, false, false, false, io::export_vdb,
     "OpenVDB level sets of shapes, and a USD stage that moves them: Houdini, Blender"},
});

// Scenes may ask for all formats, and for no others.
static_assert(std::equal(formats.begin(), formats.end(), scene::export_formats.begin(),
                         scene::export_formats.end(),
                         [](const Format& format, std::string_view name) { return format.name == name; }));

// Formats that users ask for and that are not written, with the alternative.
constexpr std::pair<const char*, const char*> refused[] = {
    {"abc",
     "Alembic is not written: Debian has no Alembic library (usd, pc2 and mdd hold moving meshes, too)"}};

// Finds a format by its name. Throws Error (usage) with a similar name if there is none.
const Format& find_format(const std::string& name) {
  std::vector<std::string> names;
  for (const Format& format : formats) {
    if (format.name == name) return format;
    names.emplace_back(format.name);
  }
  for (const auto& [known, why] : refused)
    if (known == name) throw Error(ExitStatus::usage, fmt::format("{}: {}", name, why));
  throw Error(ExitStatus::usage, fmt::format("no such format: {} ({})", name, did_you_mean(name, names)));
}

// Returns the size of a file, or of all files in a folder.
std::uintmax_t bytes_in(const fs::path& path) {
  if (!fs::is_directory(path)) return fs::file_size(path);
  std::uintmax_t bytes = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(path))
    if (entry.is_regular_file()) bytes += entry.file_size();
  return bytes;
}

// Returns the file or folder to write to.
fs::path target_of(const ExportOptions& options, const Format& format, const io::RunDirectory& run,
                   const io::Manifest& manifest) {
  if (!options.out.empty()) return options.out;
  const fs::path folder = run.root / "export";
  return format.ending == nullptr
             ? folder / format.name
             : folder / (io::video_path(run, manifest).stem().string() + "." + format.ending);
}

// Every folder of an export holds a file of this name. A folder without it is not replaced.
constexpr const char* description_name = "export.json";

// Returns whether a file begins as binary glTF.
bool is_glb(const fs::path& path) {
  constexpr std::string_view magic = "glTF";
  bool is_it = false;
  io::read_pieces(path, [&](std::string_view piece) {
    is_it = piece.starts_with(magic);
    return false;
  });
  return is_it;
}

// Throws Error (usage) unless the target may be replaced. A folder is replaced with everything in it: it must
// be empty or written by an export. A file must be empty, a binary glTF file or a Blender file.
void require_replaceable(const fs::path& target, bool is_folder) {
  std::error_code none;
  if (!is_folder && fs::exists(target, none) && !fs::is_directory(target, none) &&
      (!fs::is_regular_file(target, none) ||
       (fs::file_size(target, none) > 0 && !is_glb(target) && !is_blend(target))))
    throw Error(
        ExitStatus::usage,
        fmt::format("{}: is no file that an export wrote, and stays untouched (give another path with --out)",
                    target.string()));
  if (!fs::is_directory(target, none) || fs::is_empty(target, none) || fs::exists(target / description_name))
    return;
  throw Error(ExitStatus::usage,
              fmt::format("{}: the folder holds files that no export wrote, and stays untouched "
                          "(give another path with --out)",
                          target.string()));
}

// Throws Error (usage) for an option that has no effect on the format.
void require_applicable(const ExportOptions& options, const Format& format) {
  if (options.max_megabytes && !format.has_bound)
    throw Error(ExitStatus::usage,
                fmt::format("--max-size: has no effect on {} (glb and usd have a bound)", format.name));
  if (options.voxel && format.name != std::string_view("vdb"))
    throw Error(ExitStatus::usage,
                fmt::format("--voxel: has no effect on {} (only vdb has voxels)", format.name));
  if (options.compress && !format.can_compress)
    throw Error(
        ExitStatus::usage,
        fmt::format("--compress: {} files are not compressed (leave it out, or compress the {} afterwards)",
                    format.name, format.ending == nullptr ? "folder" : "file"));
  if (format.is_of_whole_run &&
      (options.frames || !options.bodies.empty() || options.up != "y" || options.scale != 1))
    throw Error(
        ExitStatus::usage,
        fmt::format("{}: takes the whole run, with its own axes and meters (leave out --frames, --bodies, "
                    "--up and --scale)",
                    format.name));
}

// Returns which bodies and frames are exported, and in which axes and units.
io::ExportChoice choice_of(const ExportOptions& options) {
  io::ExportChoice choice;
  choice.bodies = options.bodies;
  if (options.frames) {
    choice.first = options.frames->first.value_or(options.frames->last);
    choice.last = options.frames->last;
  }
  choice.up = options.up.at(0);
  choice.scale = options.scale;
  return choice;
}

}  // namespace

std::string export_formats() {
  std::string text;
  for (const Format& format : formats) text += fmt::format("  {:<12}{}\n", format.name, format.what);
  return text;
}

void require_format(const std::string& name) { find_format(name); }

Outcome export_run(const ExportOptions& options, Report& report) {
  const OrderlyStop orderly;
  const Format& format = find_format(options.format);
  require_applicable(options, format);
  const io::RunDirectory run = find_run(options.run);
  io::ExportedRun exported(run, choice_of(options));
  run.require_whole(run.scene());
  const scene::Scene scene = scene::read(run.scene().string(), {}, scene::Meshes::leave).scene;
  exported.set_looks(looks_of(scene, exported.manifest()));

  const fs::path target = target_of(options, format, run, exported.manifest());
  require_replaceable(target, format.ending == nullptr);
  using Staging = io::Staging;
  Staging staging(target, format.ending == nullptr ? Staging::Kind::folder : Staging::Kind::file,
                  options.overwrite ? Staging::OldTarget::is_replaced : Staging::OldTarget::is_kept);
  const int last = exported.frames().back(), count = static_cast<int>(exported.frames().size());
  const auto begin = std::chrono::steady_clock::now();
  report.start(exported.manifest().title, target.string(), exported.frames().front(), last, 0);
  int newest = -1, done = 0;
  exported.set_watch([&](int frame) {
    if (interrupted()) throw Interrupted();
    if (frame <= newest) return;  // some formats read the frames a second time
    newest = frame;
    report.exported(frame, ++done, count);
  });
  io::ExportNotes notes;
  try {
    io::FormatOptions how;
    how.compress = options.compress;
    how.voxel = options.voxel.value_or(0);
    if (options.max_megabytes) how.max_bytes = static_cast<std::uint64_t>(*options.max_megabytes * 1e6);
    notes = format.write(exported, how, staging.path());
    const fs::path description = staging.path() / description_name;
    if (format.ending == nullptr && !fs::exists(description))
      io::write_json(io::description(exported, format.name), description);
    if (interrupted()) throw Interrupted();
  } catch (const Interrupted&) {
    return {ExitStatus::interrupted,
            fmt::format("nothing was written to {}; the same command exports the run", target.string())};
  }
  const std::uintmax_t bytes = bytes_in(staging.path());
  staging.finish();
  if (scene.ground && options.bodies.empty() && !format.is_of_whole_run)
    notes.push_back(fmt::format("the ground has no mesh and is not exported: it fills all below {} = {:g}",
                                options.up, scene.ground->height * options.scale));
  if (!options.frames && last < exported.manifest().frames)
    notes.push_back(fmt::format("the run has come to frame {} of {}", last, exported.manifest().frames));
  for (const std::string& note : notes) report.note(note);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::string text = fmt::format("{} of {}, {}, in {}, {:.1f} s", counted(exported.frames().size(), "frame"),
                                 counted(exported.bodies().size(), "body", "bodies"), size_text(bytes),
                                 target.string(), seconds);
  text += io::missing_text(exported.missing());
  return {ExitStatus::done, text};
}

}  // namespace duet::tools
