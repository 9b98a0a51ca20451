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

// How a plate is pressed on a block.
struct Press {
  double mass = 10;                                       // kg
  double force = 0;                                       // N, of a control; 0: the weight alone
  double to = 0.4;                                        // m, target of the control's travel
  double stop = std::numeric_limits<double>::infinity();  // m, limit of the travel
  double damping = 0.02;                                  // s, of the block
  double longest_step = 1;                                // s
  Integration integration = Integration::semi_implicit;
};

// Returns a plate on a block of 1e6 Pa, 0.4 x 0.5 x 0.4 m, that can move up and down.
scene::Scene pressed(const Press& press) {
  scene::Scene scene = test::on_ground(0);
  scene.solver.max_time_step = press.longest_step;
  scene.solver.integration = press.integration;
  scene::DeformableBody& block =
      test::add_soft_box(scene, "block", Vec3(0, 0.25, 0), Vec3(0.4, 0.5, 0.4), 4, 1e6);
  block.shape.cells = Vec3i(4, 5, 4);
  scene.materials[0].density = 1000;
  scene.materials[0].poisson_ratio = 0;
  scene.materials[0].damping = press.damping;
  test::add_box(scene, "plate", Vec3(0, 0.5505, 0), Vec3(0.6, 0.1, 0.6), press.mass).friction = 0;
  scene::Joint& joint = test::add_joint(scene, scene::JointType::prismatic, "ground", "plate",
                                        Vec3(0, 0.5505, 0), -Vec3::UnitY());
  joint.travel.most = press.stop;
  if (press.force > 0) {
    joint.has_control = true;
    joint.control.gain = 400;
    joint.control.torque_limit = press.force;
    joint.control.target.travel = press.to;
  }
  return scene;
}

// Returns the height (m) of the plate at rest, and checks that it does not move in its own records either.
double height_at_rest(const Press& press) {
  const scene::Scene scene = pressed(press);
  Simulation simulation(scene, test::plan(scene));
  const int frames = press.damping > 0.1 ? 90 : 30;
  for (int frame = 0; frame < frames; ++frame) simulation.advance_frame();
  const RigidState& plate = simulation.world().bodies.rigid.state.front();
  EXPECT_LT(plate.velocity.norm(), 0.02);
  return plate.pose.position.y();
}

constexpr double start = 0.5505;  // m, height of the plate at the start

// The solves for damping knew contact, gravity and elastic forces, but not the force of a control. The light
// plate rose freely in them, and damping held the block down: by 21 % of the depth for 10 kg in default
// steps. In implicit steps, and with strong damping, control saw a plate that moves freely in the block's
// place: it pressed 38 % too deep, and the plate at rest had a velocity of 1.3 m/s. The heights differ by
// what still moves at the end.
TEST(EverydaySoftDriven, PistonsPressAsDeadWeights) {
  constexpr double load = 5000;                              // N
  const double gravity = test::on_ground(0).gravity.norm();  // m/s^2
  const double by_weight = height_at_rest({.mass = load / gravity}), depth = start - by_weight;
  struct Steps {
    Integration integration;
    double longest, damping;
  };
  test::Cases cases(4);  // 6 of 21
  for (const double mass : {2.0, 10.0, 100.0})
    for (const Steps& steps : {Steps{Integration::semi_implicit, 1, 0.02},
                               {Integration::semi_implicit, 3e-4, 0.02},
                               {Integration::semi_implicit, 1, 0.5},
                               {Integration::implicit, 1, 0.02},
                               {Integration::implicit, 0.004, 0.02},
                               {Integration::implicit, 0.001, 0.02},
                               {Integration::implicit, 1, 0.5}}) {
      if (!cases.takes()) continue;
      const double height = height_at_rest({.mass = mass,
                                            .force = load - mass * gravity,
                                            .damping = steps.damping,
                                            .longest_step = steps.longest,
                                            .integration = steps.integration});
      test::expect_below(std::abs(height - by_weight) / depth, 1e-3,
                         fmt::format("error of the depth, relative, {} kg, steps of {} s, damping {} s{}",
                                     mass, steps.longest, steps.damping,
                                     steps.integration == Integration::implicit ? ", implicit" : ""));
    }
}

// A control without a bound of force reaches its target, and a stop holds a plate that a weight or a control
// presses on, whatever the block resists. Control and limits used to be solved before contact, for a plate
// that moves freely: in implicit steps the plate stopped at a tenth of the way, or shook with 14 J.
TEST(EverydaySoftDriven, PressesReachTheirTargetAndTheirStop) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  test::Cases cases(3);  // 4 of 12
  for (const Integration integration : {Integration::semi_implicit, Integration::implicit})
    for (const double damping : {0.02, 0.5})
      for (const Press& kind : {Press{.force = infinite, .to = 0.02}, Press{.mass = 1000, .stop = 0.01},
                                Press{.force = 4900, .stop = 0.01}}) {
        if (!cases.takes()) continue;
        Press press = kind;
        press.damping = damping;
        press.integration = integration;
        const double wanted = std::min(press.to, press.stop);
        test::expect_below(
            std::abs(start - height_at_rest(press) - wanted) / wanted, 1e-3,
            fmt::format("error of the travel, relative, {} kg, to {} m, damping {} s{}", press.mass, wanted,
                        damping, integration == Integration::implicit ? ", implicit" : ""));
      }
}

}  // namespace
}  // namespace duet::everyday_soft_driven_test
