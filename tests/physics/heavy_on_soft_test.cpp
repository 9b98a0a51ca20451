// Rigid bodies on soft ones come to rest and stand, whatever the ratio of their masses.
#include <algorithm>
#include <cmath>

#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/scene/reader/reader.h"
#include "sim/step/world.h"

namespace duet::heavy_on_soft_test {
namespace {

// Returns a soft cube of 1 m and 10 kg under a rigid one of `ratio` times its mass. Its stiffness lets the
// heaviest load compress it by a few percent.
scene::Scene loaded(double ratio) {
  scene::Scene scene = test::on_ground(0.4);
  auto& soft =
      test::add_soft_box(scene, "soft", Vec3(0, 0.5, 0), Vec3(1, 1, 1), test::runs_in_full() ? 2 : 1, 2e7);
  soft.mass = 10;
  // The heaviest load swings at 14 rad/s, the others at 45 rad/s and more: all come to rest in 30 frames.
  scene.materials[0].damping = ratio > 1000 ? 0.03 : 0.003;
  test::add_box(scene, "load", Vec3(0, 1.5, 0), Vec3(1, 1, 1), 10 * ratio).restitution = 0;
  return scene;
}

class HeavyOnSoft : public testing::TestWithParam<double> {};

// Bounds are measurements with a margin. Contact that converges more slowly with a larger mass ratio lets
// heavy loads sink in, drift or tilt, or gains energy.
TEST_P(HeavyOnSoft, Settles) {
  const double ratio = GetParam();
  const scene::Scene scene = loaded(ratio);
  Simulation simulation(scene, test::plan(scene));
  const RigidState& load = simulation.world().bodies.rigid.state[0];
  const auto energy_of = [](const FrameStats& stats) {
    return stats.kinetic + stats.potential + stats.elastic;
  };
  const double start = simulation.stats().potential;
  double least = energy_of(simulation.stats()), risen = 0, penetration = 0;
  for (int frame = 0; frame < 30; ++frame) {
    simulation.advance_frame();
    const FrameStats stats = simulation.stats();
    penetration = std::max(penetration, stats.max_penetration);
    risen = std::max(risen, (energy_of(stats) - least) / start);
    least = std::min(least, energy_of(stats));
    EXPECT_EQ(stats.inverted, 0);
  }
  test::expect_below(penetration, 0.01, "penetration, over its size");
  test::expect_below(risen, 0.001, "energy risen, over that at the start");
  test::expect_below(load.velocity.norm(), 0.02, "speed of the load at the end, m/s");
  test::expect_below(std::hypot(load.pose.position.x(), load.pose.position.z()), 0.01,
                     "drift, over its size");
  test::expect_below(load.pose.orientation.angularDistance(Quat::Identity()), 0.01, "tilt, rad");
}

INSTANTIATE_TEST_SUITE_P(Ratios, HeavyOnSoft, testing::Values(1., 10., 100., 1000., 10000.),
                         [](const auto& ratio) { return "times_" + std::to_string(int(ratio.param)); });

}  // namespace
}  // namespace duet::heavy_on_soft_test
