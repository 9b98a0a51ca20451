// The scenes that ship, and the way from a name on the command line to a scene or a run.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/commands.h"

#include "sim/io/checkpoint.h"
#include "sim/scene/reader/reader.h"
#include "sim/simulation/simulation.h"

namespace duet::tools {

// A scene file that ships with the program.
struct ShippedScene {
  std::string name;            // path below its folder, without extension: "stack", "hard/pile"
  std::filesystem::path path;  // path of the file
};

// Returns the shipped scenes by name. They are looked for in scenes/ of the current folder, then in the
// source tree to whose build the program belongs, then where `cmake --install` puts them. Empty if there are
// none.
std::vector<ShippedScene> shipped_scenes();

// Returns the templates of `duet new` by name: the files in assets/templates beside the folder scenes/, which
// is found as for shipped_scenes().
std::vector<ShippedScene> templates();

// Returns the file of a scene that is given as a path or by its shipped name. Throws Error (usage) with a
// similar name if there is none.
std::filesystem::path find_scene(const std::string& name);

// Replaces a choice that names a run by the scene of that run. A run is a folder with a manifest whose name
// is not that of a shipped scene. The changes that the run was made with come before those of the choice, and
// an empty `out` becomes the folder of the run. Other choices stay as they are. Throws FileError if the run
// has no copy of its scene, or a damaged one.
void resolve_run(SceneChoice& choice, std::string& out);

// Returns the changes of the scene as "key=value"; --accuracy comes first.
std::vector<std::string> all_overrides(const SceneChoice& choice);

// Finds the scene of a choice and reads it with its changes. Throws SceneError, FileError or Error (usage).
scene::ReadResult read_scene(const SceneChoice& choice);

// Returns the hash by which checkpoints of a run know what is simulated: of the text of the scene that was
// read for the choice, its meshes and the active effects. A change of solver.max_substeps in the choice is
// left out, because that bound ends a simulation and changes no step: a run that it stopped continues with
// another one.
std::uint64_t run_identity(const SceneChoice& choice, const scene::ReadResult& read,
                           const EffectSet& effects);

// Returns the folder for a run of the scene: `out`, the value of --out, if it is not empty; else out/ and the
// name of a scene that ships ("out/hard/pile"); else out/ and the name of the file without its extension.
std::filesystem::path run_folder(const SceneChoice& choice, const std::string& out);

// Returns the run in the folder `name` or out/`name`. Throws FileError if neither has a manifest.
io::RunDirectory find_run(const std::string& name);

// Loads a checkpoint of `run` into a simulation of its scene. Throws FileError with the path of the file if
// the state does not fit the scene, or if its hash is not the one in the statistics of the run.
void load_checkpoint(const io::RunDirectory& run, const io::Checkpoint& checkpoint, Simulation& simulation);

}  // namespace duet::tools
