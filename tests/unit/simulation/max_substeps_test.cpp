// A frame that needs more steps than the scene allows stops with what bounds them, and the frame before is
// kept.
#include "tests/support/scenes.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/step/world.h"

namespace duet::test::max_substeps_test {
namespace {

// A rod that turns so fast that a frame takes thousands of steps.
scene::Scene spinning_rod(double rate) {
  scene::Scene scene = free_space();
  scene::RigidBody& rod = add_box(scene, "rod", Vec3::Zero(), Vec3(1, 0.1, 0.1), 1);
  rod.placement.angular_velocity = Vec3(0, 0.3 * rate, rate);
  return scene;
}

std::string failure_of(Simulation& simulation) {
  try {
    simulation.advance_frame();
  } catch (const SimulationError& error) {
    return error.what();
  }
  return {};
}

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

TEST(MaxSubsteps, AFrameThatTakesFarMoreIsRefusedSoon) {
  scene::Scene scene = spinning_rod(2e6);  // some 300,000 steps of a frame
  scene.solver.max_substeps = 20'000;
  Simulation simulation(scene, plan(scene));
  const std::string failure = failure_of(simulation);
  EXPECT_TRUE(contains(failure, "substep 200)")) << failure;
}

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
