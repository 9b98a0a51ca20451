// Bones in flesh as anybody tries them: arms that turn on a hinge in implicit steps, free bodies whose flesh
// is incompressible. They keep their spin, momentum and energy, and joints act with the torque that they
// have. Volumes of springs without damping keep their energy.
#include <algorithm>
#include <cmath>

#include "tests/support/articulated.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/rotation.h"
#include "sim/step/world.h"

namespace duet::everyday_soft_bones_test {
namespace {

using scene::Integration;

// An arm of flesh on a bone that a hinge on a static box holds at the origin.
struct Arm {
  double youngs_modulus = 1e7, damping = 0.01;  // Pa, s
  double away = 0;                              // m, distance of the flesh from the hinge
  double rate = 4;                              // rad/s, at the start
  double friction = 0;                          // N m
  double motor = 0;                             // N m, bound of a control towards 40 turns in 2 s
  double longest_step = 1;                      // s
};

scene::Scene hinged(const Arm& arm) {
  scene::Scene scene = test::free_space();
  scene.solver.integration = Integration::implicit;
  scene.solver.max_time_step = arm.longest_step;
  test::add_peg(scene, "peg", Vec3::Zero());
  scene::RigidBody& bone = test::add_box(scene, "bone", Vec3(arm.away / 2, 0, 0), Vec3(0.6, 0.25, 0.25), 3);
  bone.placement.angular_velocity = Vec3(0, 0, arm.rate);
  bone.placement.velocity = Vec3(0, arm.rate * arm.away / 2, 0);
  scene::DeformableBody& flesh =
      test::add_soft_box(scene, "flesh", Vec3(arm.away, 0, 0), Vec3::Constant(0.4), 4, arm.youngs_modulus);
  flesh.placement.angular_velocity = Vec3(0, 0, arm.rate);
  flesh.placement.velocity = Vec3(0, arm.rate * arm.away, 0);
  flesh.attach = {"bone"};
  scene.materials[0].density = 250;
  scene.materials[0].damping = arm.damping;
  scene::Joint& joint =
      test::add_joint(scene, scene::JointType::hinge, "peg", "bone", Vec3::Zero(), Vec3::UnitZ());
  joint.friction = arm.friction;
  if (arm.motor > 0) {
    joint.has_control = true;
    joint.control.lead = true;
    joint.control.torque_limit = arm.motor;
    joint.control.target.turn_rate = Vec3(7200, 0, 0);
  }
  return scene;
}

// Returns the angular momentum about the z axis, kg m^2/s.
double spin(const Simulation& simulation) { return momentum(simulation.world().bodies).angular.z(); }

// Without friction the arm turns on for ever: the solve for strong damping changed its spin, so that it lost
// 88 % of its energy in a second.
TEST(EverydaySoftBones, TurnOnAHingeForEverInImplicitSteps) {
  test::Cases cases(3);  // 3 of 8
  for (const double damping : {0.0, 0.01, 0.1, 1.0})
    for (const double longest_step : {1.0, 5e-3}) {
      if (!cases.takes()) continue;
      const scene::Scene scene = hinged({.damping = damping, .longest_step = longest_step});
      Simulation simulation(scene, test::plan(scene));
      const double start = spin(simulation);
      for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
      test::expect_below(
          std::abs(spin(simulation) / start - 1), 1e-9,
          fmt::format("change of the spin, relative, damping {} s, steps of {} s", damping, longest_step));
    }
}

// Friction and motors of the hinge change the spin by their torque times the time, wherever the flesh is.
// Friction acted with 0.4 of its torque, and a motor with a bound turned backward.
TEST(EverydaySoftBones, FeelTheTorqueOfTheirJointInImplicitSteps) {
  constexpr double torque = 5, seconds = 0.25;  // N m
  test::Cases cases(3);                         // 4 of 12
  for (const double youngs_modulus : {1e5, 1e7})
    for (const double away : {0.0, 0.2})
      for (const double longest_step : {1.0, 5e-3, 1e-3}) {
        if (!cases.takes()) continue;
        for (const bool is_motor : {false, true}) {
          const scene::Scene scene = hinged({.youngs_modulus = youngs_modulus,
                                             .away = away,
                                             .friction = is_motor ? 0 : torque,
                                             .motor = is_motor ? torque : 0,
                                             .longest_step = longest_step});
          Simulation simulation(scene, test::plan(scene));
          const double start = spin(simulation);
          for (int frame = 0; frame < 6; ++frame) simulation.advance_frame();
          const double expected = (is_motor ? 1 : -1) * torque * seconds;
          test::expect_below(
              std::abs((spin(simulation) - start) / expected - 1), 1e-6,
              fmt::format("error of the torque, relative, {:.0e} Pa, {} m, steps of {} s, {}", youngs_modulus,
                          away, longest_step, is_motor ? "motor" : "friction"));
        }
      }
}

// Returns a bone in flesh that flies and spins, or two that a motor bends.
scene::Scene flying(bool is_incompressible, bool has_motor) {
  scene::Scene scene = test::free_space();
  const Vec3 spin(0, 0, has_motor ? 0 : 15);
  for (int i = 0; i < (has_motor ? 2 : 1); ++i) {
    const std::string name = fmt::format("bone{}", i);
    scene::RigidBody& bone =
        test::add_box(scene, name, Vec3(0.05 - 0.2 * i, 0.02, 0.03), Vec3(0.15, 0.1, 0.1), 8);
    bone.placement.angular_velocity = spin;
  }
  scene::DeformableBody& flesh =
      test::add_soft_box(scene, "flesh", Vec3(-0.05, 0, 0), Vec3(0.5, 0.25, 0.25), 4, 1e5);
  flesh.shape.cells = Vec3i(8, 4, 4);
  flesh.incompressible = is_incompressible;
  flesh.placement.angular_velocity = spin;
  flesh.attach = {"bone0"};
  scene.materials[0].density = 1000;
  scene.materials[0].damping = 0.01;
  if (has_motor) {
    flesh.attach.push_back("bone1");
    scene::Joint& joint = test::add_joint(scene, scene::JointType::hinge, "bone0", "bone1",
                                          Vec3(-0.05, 0.02, 0.03), Vec3::UnitZ());
    joint.has_control = true;
    joint.control.target.sinusoid = {{Vec3(20, 0, 0), 0, 0.5, 0}};
  }
  return scene;
}

// Pressures push bones as they push particles. They took bones for fixed: a bone in incompressible flesh had
// five times its energy after two seconds, and a worm with a motor swam off.
TEST(EverydaySoftBones, IncompressibleFleshKeepsMomentumAndEnergy) {
  for (const bool has_motor : {false, true}) {
    const scene::Scene scene = flying(true, has_motor);
    Simulation simulation(scene, test::plan(scene));
    const Momentum start = momentum(simulation.world().bodies);
    const FrameStats first = simulation.stats();
    double rise = 0, volume = 0;
    for (int frame = 0; frame < 24; ++frame) {
      simulation.advance_frame();
      const FrameStats stats = simulation.stats();
      rise = std::max(rise, stats.kinetic + stats.elastic - first.kinetic - first.elastic);
      volume = std::max(volume, stats.volume_error);
    }
    const Momentum end = momentum(simulation.world().bodies);
    const char* kind = has_motor ? "with a motor" : "spinning";
    test::expect_below((end.linear - start.linear).norm(), 1e-9,
                       fmt::format("change of momentum, kg m/s, {}", kind));
    test::expect_below((end.angular - start.angular).norm(), 1e-9,
                       fmt::format("change of angular momentum, kg m^2/s, {}", kind));
    test::expect_below(volume, 1e-3, fmt::format("error of the volume, relative, {}", kind));
    if (!has_motor) test::expect_below(rise, 1e-3 * first.kinetic, "rise of the energy, J");
  }
}

// A volume of springs falls on a corner and shakes without damping. The spring on the shortest altitude was
// chosen at the beginning of a step, which added energy with each change: 79 J became 753 J.
TEST(EverydaySoftBones, SpringsWithoutDampingKeepTheirEnergy) {
  for (const double stiffness : {3e3, 3e4})
    for (const Integration integration : {Integration::semi_implicit, Integration::implicit}) {
      scene::Scene scene = test::on_ground(0.5);
      scene.solver.integration = integration;
      scene::DeformableBody& box =
          test::add_soft_box(scene, "box", Vec3(0, 0.6, 0), Vec3::Constant(0.3), 3, 1e5);
      box.placement.orientation = exponential(Vec3(0.35, 0, 0.1));
      scene.materials[0].density = 500;
      scene.materials[0].has_springs = true;
      scene.materials[0].springs = {stiffness, 0};
      Simulation simulation(scene, test::plan(scene));
      const FrameStats start = simulation.stats();
      const double at_start = start.kinetic + start.potential + start.elastic;
      double least = at_start, rise = 0;
      for (int frame = 0; frame < 36; ++frame) {
        simulation.advance_frame();
        const FrameStats stats = simulation.stats();
        const double energy = stats.kinetic + stats.potential + stats.elastic;
        rise = std::max(rise, energy - least);
        least = std::min(least, energy);
      }
      test::expect_below(rise / at_start, 0.01,
                         fmt::format("rise of the energy, relative, {:.0e} N{}", stiffness,
                                     integration == Integration::implicit ? ", implicit" : ""));
    }
}

}  // namespace
}  // namespace duet::everyday_soft_bones_test
