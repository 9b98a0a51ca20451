// `duet list`: lists the scenes that ship.
#include "tools/commands.h"
#include "tools/scene_files.h"
#include <fmt/format.h>

#include "sim/base/printable.h"

namespace duet::tools {

Outcome list() {
  const std::vector<ShippedScene> shipped = shipped_scenes();
  if (shipped.empty())
    throw Error(
        ExitStatus::files,
        "no folder scenes/ here, beside the program's folder or where it was installed (run it in the source "
        "tree, or install it with cmake --install)");
  std::string text = fmt::format("{:<20} {:<8} {:>6}  {}\n", "scene", "figure", "frames", "title");
  for (const ShippedScene& entry : shipped) {
    const scene::Scene scene = scene::read(entry.path.string()).scene;
    text += fmt::format("{:<20} {:<8} {:>6}  {}\n", printable_line(entry.name), printable_line(scene.figure),
                        scene.frames, printable_line(scene.title));
  }
  print(text);
  return {};
}

}  // namespace duet::tools
