// Tests that the program checks, simulates and draws bodies of any size.
#include <algorithm>
#include <cmath>

#include "tests/restart/program.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"

namespace duet::test::sizes_test {
namespace {

// A body of some size and place.
struct Sized {
  std::string name, shape;
  double size;      // m, height above the ground; the body falls through a fifth of it in the run
  double position;  // m, along each horizontal axis
};

void PrintTo(const Sized& sized, std::ostream* out) { *out << sized.name; }  // GoogleTest requires this name.

// Returns a mesh that is about 2 `scale` wide (m).
std::string bracket(double scale) {
  return fmt::format("{{ mesh = \"{}/assets/bracket.obj\", scale = {} }}", source_folder(), scale);
}

class Sizes : public testing::TestWithParam<Sized> {};

TEST_P(Sizes, AreCheckedSimulatedAndDrawn) {
  const ScratchFolder scratch;
  const double size = GetParam().size, at = GetParam().position;
  const std::string scene = (scratch / "scene.toml").string();
  io::write_atomically(
      scene, fmt::format(R"(
frames = 2
fps = {0}
[ground]
[[rigid]]
name = "body"
shape = {1}
position = [{2}, {3}, {2}]
density = 1000
[[rigid]]
name = "static_body"
shape = {1}
position = [{4}, {3}, {2}]
static = true
[camera]
position = [{2}, {3}, {5}]
target = [{2}, 0, {2}]
[[lights]]
name = "key"
position = [{2}, {5}, {2}]
target = [{2}, 0, {2}]
[render]
width = 32
height = 18
shadow_samples = 4
)",
                         std::sqrt(100 / size), GetParam().shape, at, size, at + 2 * size, at + 3 * size));
  const Finished check = run_duet({"check", scene});
  EXPECT_EQ(check.status, 0) << check.errors;
  const io::RunDirectory run{scratch / "run"};
  const Finished drawn = run_duet({"run", scene, "--out", run.root.string(), "--quiet"});
  ASSERT_EQ(drawn.status, 0) << drawn.errors;
  EXPECT_TRUE(fs::exists(run.image(2)));
  EXPECT_LT(fs::file_size(run.level_set(2)) + fs::file_size(run.static_level_sets()), 8e6);
  // The body falls. Its vertices are precise to a millionth of its size or to the rounding of doubles at its
  // place.
  const std::vector<Vec3> first = io::read_obj(run.mesh(0)).at(0).surface.positions,
                          last = io::read_obj(run.mesh(2)).at(0).surface.positions;
  for (std::size_t i = 0; i < last.size(); ++i) {
    EXPECT_LT(last[i].y(), first[i].y());
    EXPECT_NEAR(last[i].x(), first[i].x(), std::max(1e-6 * size, 4e-12));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Sizes, Sizes,
    testing::Values(Sized{"grain", "{ sphere = 5e-5 }", 1e-4, 0},
                    Sized{"far_grain", "{ sphere = 5e-5 }", 1e-4, 1e4},
                    Sized{"foil", "{ box = [0.01, 1e-4, 0.01] }", 0.01, 0},
                    Sized{"small_mesh", bracket(5e-5), 1e-4, 0}, Sized{"large_mesh", bracket(5e3), 1e4, 0},
                    Sized{"wire", "{ capsule = { radius = 5e-5, length = 0.1 } }", 0.1, 0},
                    Sized{"far_box", "{ box = [1, 1, 1] }", 1, 1e4},
                    Sized{"mountain", "{ box = [10000, 10000, 10000] }", 1e4, 0}),
    [](const testing::TestParamInfo<Sized>& tested) { return tested.param.name; });

}  // namespace
}  // namespace duet::test::sizes_test
