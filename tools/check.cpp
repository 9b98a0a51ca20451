// `duet check`: every problem of a scene, or the reference of all keys.
#include "tools/commands.h"
#include "tools/scene_files.h"
#include <fmt/format.h>

#include "sim/scene/reader.h"

namespace duet::tools {

Outcome check(const CheckOptions& options) {
  if (options.reference) {
    print(scene::reference());
    return {};
  }
  try {
    const scene::ReadResult read = read_scene(options.scene);
    for (const std::string& note : read.notes) print(note + '\n');
    print(fmt::format("{}: ok\n", read.scene.path));
    return {};
  } catch (const SceneError& error) {
    for (const SceneProblem& problem : error.problems()) print(problem.text() + '\n');
    const std::size_t count = error.problems().size();
    return {ExitStatus::usage, fmt::format("{} problem{}", count, count == 1 ? "" : "s")};
  }
}

}  // namespace duet::tools
