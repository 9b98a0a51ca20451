// The ledger accounts for every change of momentum, and keeping it changes nothing.
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

// A spinning ball between two soft boxes and a rigid one, in free space, all of them in each other's way.
scene::Scene crowd() {
  scene::Scene scene = test::free_space();
  add_soft_box(scene, "left", Vec3(-2.02, 0.3, 0), Vec3(2, 2, 2), 3).placement.velocity = Vec3(4, 0, 0);
  auto& ball = add_ball(scene, "ball", Vec3(0, 0, 0), 1, 600);
  ball.placement.angular_velocity = Vec3(0, 5, 1);
  add_soft_box(scene, "right", Vec3(2.02, -0.3, 0.2), Vec3(2, 2, 2), 3).placement.velocity = Vec3(-4, 0.5, 0);
  add_box(scene, "box", Vec3(0, 2.05, 0), Vec3(2, 2, 2), 3000).placement.velocity = Vec3(0, -3, 0);
  return scene;
}

// The same falling on rough ground.
scene::Scene fallen() {
  scene::Scene scene = crowd();
  scene.gravity = Vec3(0, -9.8, 0);
  scene.ground.emplace();
  scene.ground->height = -1.4;
  scene.ground->friction = 0.4;
  return scene;
}

scene::Scene made_incompressible(scene::Scene scene) {
  for (scene::DeformableBody& body : scene.deformable) body.incompressible = true;
  return scene;
}

// Every stage that changes velocities gives what comes from outside and nothing else, to rounding: 1e-10 of
// the momentum that the bodies bring along. Returns what came from outside.
Vec3 expect_balance(const scene::Scene& scene, int frames) {
  Simulation simulation(scene, test::plan(scene));
  simulation.keep_ledger();
  const double linear = 4 * 8000, angular = 2 * linear;  // kg m/s, kg m^2/s, of one soft box
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
    // The frame's change is the step's, and the sum of gravity and ground.
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

TEST(Ledger, NothingComesFromOutsideInFreeSpace) { EXPECT_EQ(expect_balance(crowd(), 8), Vec3::Zero()); }

TEST(Ledger, GravityAndGroundAccountForTheRest) {
  // Half a second of gravity on 20 t less what the ground gave: it did give.
  EXPECT_GT(expect_balance(fallen(), 12).y(), -0.9 * 0.5 * 9.8 * 2e4);
}

// The alternate order of step V, contact before the damping solve, in which the constraints take part.
TEST(Ledger, ConstraintsBeforeTheSolveKeepMomentumToo) {
  scene::Scene scene = crowd();
  scene.solver.velocity_constraints = scene::VelocityConstraints::before_solve;
  EXPECT_EQ(expect_balance(scene, 8), Vec3::Zero());
  scene = fallen();
  scene.solver.velocity_constraints = scene::VelocityConstraints::before_solve;
  EXPECT_GT(expect_balance(scene, 12).y(), -0.9 * 0.5 * 9.8 * 2e4);
}

// What pins and mass-proportional damping take is from outside: a box that hangs, braked, and is hit.
TEST(Ledger, PinsAndMassDampingAreFromOutside) {
  scene::Scene scene = crowd();
  scene.gravity = Vec3(0, -9.8, 0);
  scene.materials[0].mass_damping = 2;
  scene::Pin pin;
  pin.from = Vec3(-1, -1, -1);
  pin.to = Vec3(-1, 1, -1);
  pin.radius = 0.1;
  scene.deformable[0].pins.push_back(pin);
  // The impulse on pins is that of forces at the solution of the solve, which has to be there.
  scene.solver.cg_tolerance = 1e-13;
  const Vec3 external = expect_balance(scene, 8);
  const double gravity_alone = -9.8 * 8 / 24 * 2e4;
  EXPECT_GT((external - Vec3(0, gravity_alone, 0)).norm(), 1e3) << "pins and damping have done something";
}

// Where pressures meet contact, their impulses act at x^{n+1/2} and those of contact at x^{n+1}: what bodies
// give each other then has a moment of second order, as that of moving positions.
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

// From one geometry to the next, arms change by what the first has moved: a moment of second order.
TEST(Ledger, PushOutKeepsCentreOfMassAndMoment) {
  scene::Scene scene = crowd();
  scene.solver.push_out_iterations = 1;
  Simulation simulation(scene, test::plan(scene));
  simulation.keep_ledger();
  for (int frame = 0; frame < 8; ++frame) {
    simulation.advance_frame();
    // kg m: 20 t moved by a rounding error of metres
    EXPECT_LT(simulation.stats().max_mass_shift, 1e-10 * 2e4);
    EXPECT_LT(simulation.stats().max_moment_shift, 1e-10 * 2e4);
  }
}

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
