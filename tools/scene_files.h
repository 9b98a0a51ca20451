// The scenes that ship, and how a name on the command line becomes a scene or a run.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/commands.h"

#include "sim/io/checkpoint.h"
#include "sim/scene/reader/reader.h"
#include "sim/simulation/simulation.h"

namespace duet::tools {

struct ShippedScene {
  std::string name;            // path below scenes/ without the extension: "stack", "hard/pile"
  std::filesystem::path path;  // of the file
};

// Sorted by name. Looked for in scenes/ of the current folder, then in the source tree whose build the
// program is, and where `cmake --install` puts them.
std::vector<ShippedScene> shipped_scenes();

/// The templates of `duet new` by their names, sorted: the files of assets/templates beside the scenes.
/// Looked for where the scenes are looked for.
std::vector<ShippedScene> templates();

// The file of a scene given as a path or by its shipped name. Throws Error (usage) with a near miss.
std::filesystem::path find_scene(const std::string& name);

/// A choice that names a run (a folder, not of a shipped scene's name) becomes that of the scene it was made
/// of, with the run's changes before the choice's own; `out`, if empty, the run's folder. Other choices stay.
/// Throws FileError where the run has no copy of its scene, or a damaged one.
void resolve_run(SceneChoice& choice, std::string& out);

/// What the choice changes in the scene, --accuracy first.
std::vector<std::string> all_overrides(const SceneChoice& choice);

// Finds and reads the scene with its overrides. Throws SceneError, FileError or Error (usage).
scene::ReadResult read_scene(const SceneChoice& choice);

/// Where a run of the scene goes: the folder of --out, or out/ and the name of a scene that ships
/// ("out/hard/pile"), or out/ and the file's own name without its ending.
std::filesystem::path run_folder(const SceneChoice& choice, const std::string& out);

// The run of a folder, or of a name in out/. Throws FileError.
io::RunDirectory find_run(const std::string& name);

/// Loads a checkpoint of `run` into a simulation of its scene. Throws Error (files) with the path of the file
/// where the state does not fit the scene, or is not the one that the run's statistics tell of.
void load_checkpoint(const io::RunDirectory& run, const io::Checkpoint& checkpoint, Simulation& simulation);

}  // namespace duet::tools
