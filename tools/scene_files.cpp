#include "tools/scene_files.h"

#include <algorithm>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "sim/base/near_miss.h"
#include "sim/io/run_source.h"
#include "sim/io/stats_log.h"

namespace duet::tools {
namespace fs = std::filesystem;
namespace {

// Folders that may hold the scenes, relative to the folder of the program.
constexpr const char* places_of_scenes[] = {
    "../scenes",                // build/duet
    "../share/duet/scenes",     // installed: bin/duet
    "../../share/duet/scenes",  // installed and portable: libexec/duet/duet-x86-64
    "../../../scenes"};         // build/libexec/duet/duet-x86-64

// Returns the TOML files in a folder and below it, sorted by name.
std::vector<ShippedScene> scenes_below(const fs::path& folder) {
  std::vector<ShippedScene> scenes;
  std::error_code missing;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder, missing)) {
    if (entry.path().extension() != ".toml") continue;
    const fs::path name = entry.path().lexically_relative(folder);
    scenes.push_back({(name.parent_path() / name.stem()).generic_string(), entry.path()});
  }
  std::sort(scenes.begin(), scenes.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return scenes;
}

// Returns the scenes of a folder whose path starts at scenes/. They are looked for in the current folder,
// then in the places relative to the program; the first one that has any counts.
std::vector<ShippedScene> scenes_beside(const fs::path& from_scenes) {
  std::vector<ShippedScene> scenes = scenes_below(("scenes" / from_scenes).lexically_normal());
  if (!scenes.empty()) return scenes;
  std::error_code unknown;
  const fs::path folder = fs::read_symlink("/proc/self/exe", unknown).parent_path();
  for (const char* place : places_of_scenes) {
    scenes = scenes_below((folder / place / from_scenes).lexically_normal());
    if (!scenes.empty()) break;
  }
  return scenes;
}

}  // namespace

std::vector<ShippedScene> shipped_scenes() { return scenes_beside("."); }

std::vector<ShippedScene> templates() { return scenes_beside("../assets/templates"); }

fs::path find_scene(const std::string& name) {
  std::error_code missing;
  if (fs::exists(name, missing) && !fs::is_directory(name, missing)) return name;
  const std::vector<ShippedScene> shipped = shipped_scenes();
  std::vector<std::string> names;
  for (const ShippedScene& scene : shipped) {
    if (scene.name == name) return scene.path;
    names.push_back(scene.name);
  }
  const std::string hint = names.empty()
                               ? "the program finds no scenes beside it: give the path of a scene file"
                               : did_you_mean(fs::path(name).stem().string(), names);
  throw Error(ExitStatus::usage, fmt::format("{}: no such scene ({})", name, hint));
}

void resolve_run(SceneChoice& choice, std::string& out) {
  if (!fs::exists(io::RunDirectory{choice.name}.manifest())) return;
  for (const ShippedScene& scene : shipped_scenes())
    if (scene.name == choice.name) return;
  const io::RunDirectory run = io::open_run(choice.name);
  const std::optional<io::RunSource> source = io::read_source(run);
  if (!source)
    throw FileError(choice.name, "the run has no copy of its scene (programs before December 2026 kept none)",
                    "give the scene itself; its path is in manifest.json");
  run.require_whole(io::source_scene(run, *source));
  for (const auto& [name, path] : source->files) run.require_whole(path);
  std::vector<std::string> set = source->set;
  if (!choice.accuracy.empty()) set.push_back("solver.accuracy=" + std::exchange(choice.accuracy, {}));
  set.insert(set.end(), choice.set.begin(), choice.set.end());
  choice.set = std::move(set);
  choice.without.insert(choice.without.begin(), source->without.begin(), source->without.end());
  choice.files = source->files;
  if (out.empty()) out = choice.name;
  choice.name = io::source_scene(run, *source).string();
}

std::vector<std::string> all_overrides(const SceneChoice& choice) {
  std::vector<std::string> overrides = choice.set;
  if (!choice.accuracy.empty()) overrides.insert(overrides.begin(), "solver.accuracy=" + choice.accuracy);
  return overrides;
}

scene::ReadResult read_scene(const SceneChoice& choice) {
  return scene::read(find_scene(choice.name).string(), all_overrides(choice), scene::Meshes::read,
                     choice.files);
}

std::uint64_t run_identity(const SceneChoice& choice, const scene::ReadResult& read,
                           const EffectSet& effects) {
  constexpr std::string_view bound = "solver.max_substeps";
  SceneChoice others = choice;
  std::erase_if(others.set, [&](const std::string& change) {
    return change.starts_with(bound) && change.find_first_not_of(' ', bound.size()) == change.find('=');
  });
  const bool is_same = others.set.size() == choice.set.size();
  const std::string source = is_same ? read.source
                                     : scene::read_text(read.written, read.scene.path, all_overrides(others),
                                                        scene::Meshes::leave, choice.files)
                                           .source;
  return io::scene_identity(source, effects) ^ read.meshes;
}

std::filesystem::path run_folder(const SceneChoice& choice, const std::string& out) {
  if (!out.empty()) return out;
  const fs::path file = find_scene(choice.name);
  for (const ShippedScene& scene : shipped_scenes()) {
    std::error_code missing;
    if (fs::equivalent(scene.path, file, missing)) return fs::path("out") / scene.name;
  }
  return fs::path("out") / file.stem();
}

io::RunDirectory find_run(const std::string& name) {
  for (const fs::path& folder : {fs::path(name), fs::path("out") / name}) {
    if (fs::exists(io::RunDirectory{folder}.manifest())) return io::open_run(folder);
  }
  throw FileError(name, "is no run directory: it has no manifest.json",
                  "`duet sim SCENE --out DIR` makes one");
}

void load_checkpoint(const io::RunDirectory& run, const io::Checkpoint& checkpoint, Simulation& simulation) {
  const std::string path = io::checkpoint_path(run, checkpoint.frame).string();
  const std::string remedy =
      "remove the file to continue after an older one, or simulate the scene anew in another folder";
  try {
    simulation.load_state(checkpoint.state);
  } catch (const Error& error) {
    throw FileError(path, error.what(), remedy);
  }
  if (simulation.frame() != checkpoint.frame)
    throw FileError(
        path, fmt::format("is of frame {} and holds frame {}", checkpoint.frame, simulation.frame()), remedy);
  const std::uint64_t hash = simulation.stats().hash;
  const std::optional<std::uint64_t> recorded = io::recorded_hash(run, checkpoint.frame);
  if (recorded && *recorded != hash)
    throw FileError(path,
                    fmt::format("holds a state with the hash {:016x}, and {} tells {:016x} of frame {}", hash,
                                run.stats().string(), *recorded, checkpoint.frame),
                    remedy);
}

}  // namespace duet::tools
