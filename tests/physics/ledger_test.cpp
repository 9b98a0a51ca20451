// The ledger accounts for every change of momentum, and keeping it changes no result.
#include <algorithm>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/step.h"

namespace duet::ledger_test {
namespace {

using test::add_ball;
using test::add_box;
using test::add_soft_box;

// Returns a spinning ball between two soft boxes and a rigid one, in free space, which run into each other.
scene::Scene crowd() {
  scene::Scene scene = test::free_space();
  add_soft_box(scene, "left", Vec3(-2.02, 0.3, 0), Vec3(2, 2, 2), 3).placement.velocity = Vec3(4, 0, 0);
  auto& ball = add_ball(scene, "ball", Vec3(0, 0, 0), 1, 600);
  ball.placement.angular_velocity = Vec3(0, 5, 1);
  add_soft_box(scene, "right", Vec3(2.02, -0.3, 0.2), Vec3(2, 2, 2), 3).placement.velocity = Vec3(-4, 0.5, 0);
  add_box(scene, "box", Vec3(0, 2.05, 0), Vec3(2, 2, 2), 3000).placement.velocity = Vec3(0, -3, 0);
  return scene;
}

// Returns the bodies of crowd(), which fall on rough ground.
scene::Scene fallen() {
  scene::Scene scene = crowd();
  scene.gravity = Vec3(0, -9.8, 0);
  scene.ground.emplace();
  scene.ground->height = -1.4;
  scene.ground->friction = 0.4;
  return scene;
}

// Returns the scene with all its deformable bodies made incompressible.
scene::Scene made_incompressible(scene::Scene scene) {
  for (scene::DeformableBody& body : scene.deformable) body.incompressible = true;
  return scene;
}

// Checks that every stage that changes velocities gives external momentum and no other, to 1e-10 of the
// momentum of a soft box. Returns the external momentum.
Vec3 expect_balance(const scene::Scene& scene, int frames) {
  Simulation simulation(scene, test::plan(scene));
  simulation.keep_ledger();
  const double linear = 4 * 8000, angular = 2 * linear;  // kg m/s and kg m^2/s, of one soft box
  double max_defect = 0, max_change = 0;
  Vec3 external = Vec3::Zero();
  const Vec3 first_velocity = simulation.world().bodies.rigid.state[0].velocity;
  for (int frame = 0; frame < frames; ++frame) {
    const FrameStats before = simulation.stats();
    simulation.advance_frame();
    const FrameStats stats = simulation.stats();
    const Vec3 change = simulation.world().bodies.rigid.state[0].velocity - first_velocity;
    max_change = std::max(max_change, change.norm());
    for (const LedgerStats& stage : stats.ledger) {
      max_defect = std::max(max_defect, stage.momentum_defect / linear);
      EXPECT_LT(stage.momentum_defect, 1e-10 * linear) << stage.name << ", frame " << frame;
      if (stage.name == name(Stage::advance_position) || stage.name == "step")
        continue;  // moving positions leaves an angular defect of second order
      EXPECT_LT(stage.angular_momentum_defect, 1e-10 * angular) << stage.name << ", frame " << frame;
    }
    // The change over a frame is that of the step in the ledger, and the sum of what gravity and ground gave.
    const LedgerStats& step = stats.ledger.back();
    EXPECT_LT((stats.momentum - before.momentum - step.external_momentum).norm(), 1e-10 * linear);
    EXPECT_LT((stats.momentum - before.momentum - step.momentum).norm(), 1e-10 * linear);
    EXPECT_LT((stats.angular_momentum - before.angular_momentum - step.angular_momentum).norm(),
              1e-9 * angular);
    EXPECT_NEAR(step.kinetic, stats.kinetic - before.kinetic, 1e-10 * linear * 10);
    external += step.external_momentum;
  }
  EXPECT_GT(max_change, 0.5) << "nothing was tested";
  test::expect_below(max_defect, 1e-10, "largest defect of a stage, over the momentum of a body");
  return external;
}

// All forces are internal, so the external momentum is exactly zero.
TEST(Ledger, NothingComesFromOutsideInFreeSpace) { EXPECT_EQ(expect_balance(crowd(), 8), Vec3::Zero()); }

TEST(Ledger, GravityAndGroundAccountForTheRest) {
  // The momentum that the ground gave reduces that of gravity, which is half a second of g on 20 t, by at
  // least a tenth.
  EXPECT_GT(expect_balance(fallen(), 12).y(), -0.9 * 0.5 * 9.8 * 2e4);
}

// The alternate order of step V has contact before the damping solve, in which the constraints take part.
TEST(Ledger, ConstraintsBeforeTheSolveKeepMomentumToo) {
  scene::Scene scene = crowd();
  scene.solver.velocity_constraints = scene::VelocityConstraints::before_solve;
  EXPECT_EQ(expect_balance(scene, 8), Vec3::Zero());
  scene = fallen();
  scene.solver.velocity_constraints = scene::VelocityConstraints::before_solve;
  EXPECT_GT(expect_balance(scene, 12).y(), -0.9 * 0.5 * 9.8 * 2e4);
}

// Impulses of pins and of mass-proportional damping are external: a box that hangs, is braked, and is hit.
TEST(Ledger, PinsAndMassDampingAreFromOutside) {
  scene::Scene scene = crowd();
  scene.gravity = Vec3(0, -9.8, 0);
  scene.materials[0].mass_damping = 2;
  scene::Pin pin;
  pin.from = Vec3(-1, -1, -1);
  pin.to = Vec3(-1, 1, -1);
  pin.radius = 0.1;
  scene.deformable[0].pins.push_back(pin);
  // The impulse on pins is computed from forces at the solution of the solve, so the solve must be accurate.
  scene.solver.cg_tolerance = 1e-13;
  const Vec3 external = expect_balance(scene, 8);
  const double gravity_alone = -9.8 * 8 / 24 * 2e4;
  EXPECT_GT((external - Vec3(0, gravity_alone, 0)).norm(), 1e3) << "pins and damping have done something";
}

// Pressures give no momentum. Where they meet contact, their impulses act at x^{n+1/2} and those of contact
// at x^{n+1}, so impulses between bodies have a moment of second order, as moving positions has; therefore
// moments are compared in the stages of pressures alone.
TEST(Ledger, PressuresGiveNothing) {
  for (const bool on_ground : {false, true}) {
    Simulation simulation(made_incompressible(on_ground ? fallen() : crowd()),
                          test::plan(made_incompressible(on_ground ? fallen() : crowd())));
    simulation.keep_ledger();
    const double linear = 4 * 8000, angular = 2 * linear;
    for (int frame = 0; frame < 8; ++frame) {
      simulation.advance_frame();
      EXPECT_GT(simulation.stats().pressure_iterations, 0);
      for (const LedgerStats& stage : simulation.stats().ledger) {
        EXPECT_LT(stage.momentum_defect, 1e-10 * linear) << stage.name << ", frame " << frame;
        if (stage.name == name(Stage::volume_correction) || stage.name == name(Stage::make_incompressible)) {
          EXPECT_LT(stage.angular_momentum_defect, 1e-10 * angular) << stage.name << ", frame " << frame;
        }
      }
    }
  }
}

// Interpenetration resolution keeps sum m d and sum x cross m d at zero, with d the displacements and x the
// positions, within one iteration. From one iteration to the next arms change by d, which leaves a moment of
// second order.
TEST(Ledger, PushOutKeepsCenterOfMassAndMoment) {
  scene::Scene scene = crowd();
  scene.solver.push_out_iterations = 1;
  Simulation simulation(scene, test::plan(scene));
  simulation.keep_ledger();
  for (int frame = 0; frame < 8; ++frame) {
    simulation.advance_frame();
    // The bound is in kg m: a rounding error of meters, times 20 t.
    EXPECT_LT(simulation.stats().max_mass_shift, 1e-10 * 2e4);
    EXPECT_LT(simulation.stats().max_moment_shift, 1e-10 * 2e4);
  }
}

// Runs with and without the ledger have the same bits.
TEST(Ledger, ChangesNoResult) {
  const scene::Scene scene = fallen();
  Simulation plain(scene, test::plan(scene)), watched(scene, test::plan(scene));
  watched.keep_ledger();
  for (int frame = 0; frame < 3; ++frame) {
    plain.advance_frame();
    watched.advance_frame();
    EXPECT_EQ(plain.stats().hash, watched.stats().hash);
  }
  EXPECT_TRUE(plain.stats().ledger.empty());
}

}  // namespace
}  // namespace duet::ledger_test
