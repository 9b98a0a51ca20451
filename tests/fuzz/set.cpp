// Overrides of --set: each line of the input is one, for a scene with most kinds of tables.
#include <sstream>
#include <vector>

#include "tests/fuzz/harness.h"

#include "sim/scene/reader/reader.h"

using namespace duet;

namespace {

const std::string scene_text = R"(
title = "Overrides"
parameters = { height = 2 }
[solver]
cfl = 0.5
[ground]
height = 0
[materials.rubber]
youngs_modulus = 1e5
springs = { stiffness = 100 }
[[rigid]]
name = "ball"
shape = { sphere = 0.3 }
look = "red"
position = [0, "$height", 0]
mass = 1
[[rigid]]
name = "wheel"
shape = { cylinder = { radius = 0.2, height = 0.1 } }
position = [0, 3, 0]
motion = { spin = [{ axis = [0, 1, 0], rate = 1 }] }
[[joints]]
name = "hinge"
type = "hinge"
parent = "wheel"
child = "ball"
position = [0, 2.5, 0]
control = { target = { turn = [30, 0, 0] } }
[[deformable]]
name = "block"
shape = { box = [1, 1, 1], cells = [2, 2, 2] }
position = [3, 1, 0]
material = "rubber"
[[prefabs.pair.rigid]]
name = "cube"
shape = { box = [1, 1, 1] }
mass = 1
[[instances]]
name = "copies"
prefab = "pair"
grid = [2, 1, 2]
step = [3, 1, 3]
position = [0, 0, 5]
[looks.red]
color = [1, 0, 0]
[camera]
position = [3, 2, 5]
target = [0, 0.7, 0]
[[lights]]
name = "key"
position = [4, 6, 3]
power = 1500
)";

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::string> overrides;
  std::istringstream lines(fuzz::text_of(data, size));
  for (std::string line; std::getline(lines, line);) overrides.push_back(line);
  std::string changed;
  const bool accepted = fuzz::is_accepted(
      [&] { changed = scene::read_text(scene_text, "fuzz.toml", overrides, scene::Meshes::leave).source; });
  if (accepted) scene::read_text(changed, "again.toml", {}, scene::Meshes::leave);
  return 0;
}
