// The one-way coupling (--without two_way), in which deformable bodies do not push back, against the two-way
// coupling.
#include "tests/support/margin.h"
#include "tests/support/places.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/scene/reader/reader.h"
#include "sim/step/world.h"

namespace duet::one_way_test {
namespace {

// Result of a strike.
struct Outcome {
  Vec3 ball = Vec3::Zero(), start = Vec3::Zero();  // velocities of the ball, m/s
  double momentum = 0;  // change of the total momentum, over that of the ball at the start
  double energy = 0;    // kinetic plus elastic energy at the end over that at the start
};

// Simulates scenes/study/one_way.toml without the effects of the list.
Outcome strike(const std::vector<std::string>& without) {
  scene::Scene scene = scene::read(test::source_folder() + "/scenes/study/one_way.toml").scene;
  Simulation simulation(scene, scene::plan_effects(scene, without).active());
  const RigidState& ball = simulation.world().bodies.rigid.state[0];
  const FrameStats first = simulation.stats();
  Outcome outcome;
  outcome.start = ball.velocity;
  for (int frame = 0; frame < 12; ++frame) simulation.advance_frame();
  const FrameStats last = simulation.stats();
  outcome.ball = ball.velocity;
  outcome.momentum = (last.momentum - first.momentum).norm() / first.momentum.norm();
  outcome.energy = (last.kinetic + last.elastic) / (first.kinetic + first.elastic);
  return outcome;
}

// Two-way coupling keeps momentum to rounding and gains no energy. Without it, momentum and energy appear
// from nothing. This checks that the effect can be switched off, and that the test would notice.
TEST(TwoWay, WithoutItMomentumComesFromNothing) {
  const Outcome both = strike({});
  test::expect_below(both.momentum, 1e-10, "two-way: momentum gained");
  test::expect_below(both.energy, 1 + 1e-3, "two-way: energy at the end");
  EXPECT_LT(both.ball.x(), 0.6 * both.start.x()) << "the soft ball stops it";
  const Outcome one_way = strike({"two_way"});
  EXPECT_EQ(one_way.ball, one_way.start) << "nothing deformable changes the ball's way";
  test::expect_above(one_way.momentum, 0.5, "one-way: momentum gained");
  test::expect_above(one_way.energy, 1.2, "one-way: energy at the end");
}

}  // namespace
}  // namespace duet::one_way_test
