// Soft bodies that kinematic bodies drive by contact, in implicit steps: plates that squeeze and lift a cube,
// and a belt. They take up the work of the drive and no more. A kinematic body that touches nothing changes
// nothing. Pistons on controlled joints press as deep as a dead weight of their force.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/articulated.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::everyday_soft_driven_test {
namespace {

using scene::Integration;

// Adds a kinematic box of friction 0.8 that moves from `from` to `to` (m) in one second.
void add_driven(scene::Scene& scene, std::string_view name, const Vec3& size, const Vec3& from,
                const Vec3& to) {
  scene::RigidBody& body = test::add_box(scene, name, from, size, 1);
  body.mass.reset();
  body.is_kinematic = true;
  body.friction = 0.8;
  scene::Motion motion;
  motion.keyframes = {{0, from, {}, false, {}}, {1, to, {}, false, {}}};
  body.motion = motion;
}

// Returns a jelly cube of 0.3 m on the ground, between two plates that squeeze it by a sixth.
scene::Scene squeezed(double youngs_modulus, double friction_of_ground, Integration integration) {
  scene::Scene scene = test::on_ground(friction_of_ground);
  scene.solver.integration = integration;
  test::add_soft_box(scene, "cube", Vec3(0, 0.15, 0), Vec3::Constant(0.3), 3, youngs_modulus);
  scene.materials[0].density = 1000;
  scene.materials[0].poisson_ratio = 0.4;
  scene.materials[0].damping = 0.01;
  for (const double side : {-1.0, 1.0})
    add_driven(scene, side < 0 ? "left" : "right", Vec3(0.05, 0.3, 0.3), Vec3(0.2 * side, 0.15, 0),
               Vec3(0.15 * side, 0.15, 0));
  return scene;
}

// Returns the elastic energy (J) of a squeezed cube at the end of the motion.
double stored(const scene::Scene& scene) {
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
  const FrameStats stats = simulation.stats();
  EXPECT_EQ(stats.inverted, 0);
  return stats.elastic;
}

// The plates' work is stored as elastic energy. The bound is the difference of the two integrations in the
// friction of the ends. Implicit steps used to end with up to 1e15 J: the check that repeats steps which gain
// energy left out all scenes with moving kinematic bodies.
TEST(EverydaySoftDriven, SqueezedCubesStoreTheWorkOfThePlates) {
  test::Cases cases(4);  // 1 of 4
  for (const double youngs_modulus : {1e5, 1e6})
    for (const double friction : {0.0, 0.5}) {
      if (!cases.takes()) continue;
      const double semi_implicit = stored(squeezed(youngs_modulus, friction, Integration::semi_implicit)),
                   implicit = stored(squeezed(youngs_modulus, friction, Integration::implicit));
      test::expect_below(std::abs(implicit / semi_implicit - 1), 0.05,
                         fmt::format("energy, relative, with {:g} Pa and {}", youngs_modulus, friction));
    }
}

// Returns the largest rise of the energy above an earlier value, J, of a soft cube between two static walls
// with 200 kg on it, in implicit steps.
double rise_in_channel(bool with_far_body) {
  scene::Scene scene = test::on_ground(0.5);
  scene.solver.integration = Integration::implicit;
  test::add_soft_box(scene, "cube", Vec3(0, 0.15, 0), Vec3::Constant(0.3), 4, 1e5);
  scene.materials[0].density = 1000;
  scene.materials[0].poisson_ratio = 0.4;
  scene.materials[0].damping = 0.01;
  for (const double side : {-1.0, 1.0}) {
    scene::RigidBody& wall =
        test::add_box(scene, side < 0 ? "left" : "right", Vec3(0.201 * side, 0.2, 0), Vec3(0.1, 0.4, 1), 1);
    wall.mass.reset();
    wall.friction = 0.8;
    wall.is_static = true;
  }
  test::add_box(scene, "weight", Vec3(0, 0.42, 0), Vec3(0.28, 0.2, 0.28), 200);
  if (with_far_body) add_driven(scene, "far", Vec3(0.2, 0.2, 0.2), Vec3(20, 5, 0), Vec3(20, 6, 0));
  Simulation simulation(scene, test::plan(scene));
  double least = std::numeric_limits<double>::infinity(), rise = 0;
  for (int frame = 0; frame < 12; ++frame) {
    simulation.advance_frame();
    const FrameStats stats = simulation.stats();
    const double energy = stats.kinetic + stats.potential + stats.elastic;
    least = std::min(least, energy);
    rise = std::max(rise, energy - least);
  }
  return rise;
}

// A body that touches nothing does no work, and the check of energy stays on. The bound is a thousandth of
// what the weight of 200 kg moves, some 50 J.
TEST(EverydaySoftDriven, AFarKinematicBodyGivesNoEnergy) {
  for (const bool with_far_body : {false, true})
    test::expect_below(rise_in_channel(with_far_body), 0.05,
                       with_far_body ? "rise, J, with a far body" : "rise, J, alone");
}

// Returns a plate of `mass` (kg) on a block of 1e6 Pa, 0.4 x 0.5 x 0.4 m, that can move up and down. A
// control presses it down with `force` (N).
scene::Scene piston(double mass, double force, double longest_step) {
  scene::Scene scene = test::on_ground(0);
  scene.solver.max_time_step = longest_step;
  scene::DeformableBody& block =
      test::add_soft_box(scene, "block", Vec3(0, 0.25, 0), Vec3(0.4, 0.5, 0.4), 4, 1e6);
  block.shape.cells = Vec3i(4, 5, 4);
  scene.materials[0].density = 1000;
  scene.materials[0].poisson_ratio = 0;
  scene.materials[0].damping = 0.02;
  test::add_box(scene, "plate", Vec3(0, 0.5505, 0), Vec3(0.6, 0.1, 0.6), mass).friction = 0;
  scene::Joint& joint = test::add_joint(scene, scene::JointType::prismatic, "ground", "plate",
                                        Vec3(0, 0.5505, 0), -Vec3::UnitY());
  if (force > 0) {
    joint.has_control = true;
    joint.control.gain = 400;
    joint.control.torque_limit = force;
    joint.control.target.travel = 0.4;
  }
  return scene;
}

// Returns the height (m) of the plate at rest.
double height_at_rest(const scene::Scene& scene) {
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 30; ++frame) simulation.advance_frame();
  return simulation.world().bodies.rigid.state.front().pose.position.y();
}

// The solves for damping knew contact, gravity and elastic forces, but not the force of a control. The light
// plate rose freely in them, and damping held the block down: by 21 % of the depth for 10 kg in default
// steps. The heights differ by what still moves after 1.5 s, 17 times the damping time of the plate on the
// block.
TEST(EverydaySoftDriven, PistonsPressAsDeadWeights) {
  constexpr double load = 5000;                              // N
  const double gravity = test::on_ground(0).gravity.norm();  // m/s^2
  const double by_weight = height_at_rest(piston(load / gravity, 0, 1)), depth = 0.5505 - by_weight;
  test::Cases cases(2);  // 3 of 6
  for (const double mass : {2.0, 10.0, 100.0})
    for (const double longest_step : {1.0, 3e-4}) {
      if (!cases.takes()) continue;
      const double height = height_at_rest(piston(mass, load - mass * gravity, longest_step));
      test::expect_below(
          std::abs(height - by_weight) / depth, 1e-3,
          fmt::format("error of the depth, relative, {} kg, steps of {} s", mass, longest_step));
    }
}

}  // namespace
}  // namespace duet::everyday_soft_driven_test
