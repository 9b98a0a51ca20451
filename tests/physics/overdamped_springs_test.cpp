// Springs beyond critical damping creep. Steps that follow their damping time instead of their stiffness
// (`solver.relaxation`) must lead to the same state of rest.
#include <cmath>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::overdamped_springs_test {
namespace {

constexpr double gravity = 30;  // m/s^2

// State at the end.
struct End {
  double height = 0;   // m, of the center of mass
  double elastic = 0;  // J
  int substeps = 0;
};

// Returns the state of a box of springs that has fallen on the ground under three times its weight and come
// to rest.
End fallen(double relaxation) {
  scene::Scene scene = test::on_ground(0);
  scene.fps = 24;
  scene.gravity = Vec3(0, -gravity, 0);
  scene.solver.relaxation = relaxation;
  test::add_soft_box(scene, "soft", Vec3(0, 0.55, 0), Vec3(1, 1, 1), 3);
  scene::Material& material = scene.materials[0];
  material.has_springs = true;
  material.springs = {1e4, 10};
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 120; ++frame) simulation.advance_frame();
  const FrameStats stats = simulation.stats();
  EXPECT_LT(stats.kinetic, 1e-4 * stats.potential);
  return {stats.potential / (gravity * 1000), stats.elastic, stats.substeps};
}

// Without friction, which remembers the path, rest is one state, in which the box has sunk by 31 mm. Steps of
// 14 ms and of 4 ms leave it trembling by less than 0.1 micrometers, a tenth of the bound on the height.
TEST(OverdampedSprings, ComeToTheSameRestInLongerSteps) {
  const End followed = fallen(0), lifted = fallen(0.25);
  EXPECT_LT(lifted.substeps, 0.4 * followed.substeps);
  test::expect_below(std::abs(lifted.height - followed.height), 1e-6, "difference in height, m");
  test::expect_below(std::abs(lifted.elastic / followed.elastic - 1), 1e-4,
                     "relative difference of the energy");
}

}  // namespace
}  // namespace duet::overdamped_springs_test
