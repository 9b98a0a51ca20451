// A frame that needs more steps than the scene allows ends with an error that names what bounds the steps,
// and the frame before it is kept.
#include "tests/support/scenes.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/step/world.h"

namespace duet::test::max_substeps_test {
namespace {

// Returns a rod that turns so fast (`rate`, rad/s) that a frame takes thousands of steps.
scene::Scene spinning_rod(double rate) {
  scene::Scene scene = free_space();
  scene::RigidBody& rod = add_box(scene, "rod", Vec3::Zero(), Vec3(1, 0.1, 0.1), 1);
  rod.placement.angular_velocity = Vec3(0, 0.3 * rate, rate);
  return scene;
}

// Returns the message of the error with which the next frame ends; empty if it succeeds.
std::string failure_of(Simulation& simulation) {
  try {
    simulation.advance_frame();
  } catch (const SimulationError& error) {
    return error.what();
  }
  return {};
}

// The message names the frame, the bound, the body whose turn makes the steps short, and the setting.
TEST(MaxSubsteps, AFrameThatTakesMoreIsRefusedWithItsCause) {
  scene::Scene scene = spinning_rod(2000);
  scene.solver.max_substeps = 100;
  Simulation simulation(scene, plan(scene));
  const Quat before = simulation.world().bodies.rigid.state[0].pose.orientation;
  const std::string failure = failure_of(simulation);
  for (const char* part : {"frame 1", "breaks the bound 100", "turn of `rod`", "solver.max_substeps"})
    EXPECT_TRUE(contains(failure, part)) << part << ": " << failure;
  EXPECT_EQ(simulation.frame(), 0);
  EXPECT_EQ(simulation.world().bodies.rigid.state[0].pose.orientation.coeffs(), before.coeffs())
      << "the frame before is kept";
}

// A frame that would take far too many steps is refused after 200 of them and not after the allowed 20,000.
TEST(MaxSubsteps, AFrameThatTakesFarMoreIsRefusedSoon) {
  scene::Scene scene = spinning_rod(2e6);  // about 300,000 steps in a frame
  scene.solver.max_substeps = 20'000;
  Simulation simulation(scene, plan(scene));
  const std::string failure = failure_of(simulation);
  EXPECT_TRUE(contains(failure, "substep 200)")) << failure;
}

// A frame that takes exactly the allowed number of steps is simulated, with the same result as without the
// bound.
TEST(MaxSubsteps, AFrameThatTakesThemIsSimulated) {
  scene::Scene scene = spinning_rod(2000);
  Simulation counting(scene, plan(scene));
  counting.advance_frame();
  scene.solver.max_substeps = counting.stats().substeps;
  Simulation simulation(scene, plan(scene));
  EXPECT_EQ(failure_of(simulation), "");
  EXPECT_EQ(simulation.stats().hash, counting.stats().hash);
}

}  // namespace
}  // namespace duet::test::max_substeps_test
