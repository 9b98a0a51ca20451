// Rolling bodies keep their speed, height and line: every round shape, on any support, at any speed, with any
// step. Down a slope they have the acceleration of the textbook.
#include <algorithm>
#include <cmath>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/step/world.h"

namespace duet::everyday_rigid_rolling_test {
namespace {

using test::Support;

// Duration of a run, s.
constexpr double seconds = 2;

// The largest deviations of a rolling body.
struct Rolled {
  double speed = 0;  // of the speed, relative to it
  double hop = 0;    // of the height, over the radius
  double drift = 0;  // sideways, over the radius
};

// Rolls the shape for two seconds at `speed` sizes per second, without slipping at the start.
Rolled roll(const test::EverydayShape& shape, Support support, double size, double speed,
            double longest_step) {
  scene::Scene scene;
  test::add_support(scene, support, size);
  scene::RigidBody& body = test::add_shape(scene, shape, size, 0);
  const double v = speed * size, radius = shape.height * size;
  body.placement.velocity = Vec3(v, 0, 0);
  body.placement.angular_velocity = Vec3(0, 0, -v / radius);
  scene.gravity = Vec3(0, -9.8 * size, 0);
  scene.solver.max_time_step = longest_step;
  Simulation simulation(scene, test::plan(scene));
  const RigidState& state =
      simulation.world().bodies.rigid.state[test::index_of_shape(simulation.world().bodies)];
  Rolled rolled;
  for (int frame = 1; frame <= seconds * scene.fps; ++frame) {
    simulation.advance_frame();
    rolled.speed = std::max(rolled.speed, std::abs(state.velocity.x() / v - 1));
    rolled.hop = std::max(rolled.hop, std::abs(state.pose.position.y() / radius - 1));
    rolled.drift = std::max(rolled.drift, std::abs(state.pose.position.z()) / radius);
  }
  return rolled;
}

// Checks that nothing brakes or turns the body: 1e-4 and 1e-3 leave room for the tolerance of the contact
// solve.
void expect_steady(const test::EverydayShape& shape, Support support, double size, double speed,
                   double longest_step = 1.0 / 48) {
  const Rolled rolled = roll(shape, support, size, speed, longest_step);
  const std::string name = fmt::format("{} on {}, size {}, speed {}, step {}", shape.name, name_of(support),
                                       size, speed, longest_step);
  EXPECT_LT(rolled.speed, 1e-4) << name;
  EXPECT_LT(rolled.hop, 1e-4) << name;
  EXPECT_LT(rolled.drift, 1e-3) << name;
}

// A round body touches flat supports at its support points alone. Contacts at samples, at the edges of a
// support's triangles or at internal edges of tiles would brake it or make it hop.
TEST(EverydayRigidRolling, KeepsItsSpeedOnAnything) {
  test::Cases cases(7);  // 11 of 72
  for (const test::EverydayShape& shape : test::shapes_that_roll())
    for (const Support support : {Support::ground, Support::static_box, Support::tiles, Support::mesh,
                                  Support::kinematic_box, Support::dynamic_box})
      for (const double speed : {1.0, 6.0})
        if (cases.takes()) expect_steady(shape, support, 1, speed);
}

// Neither speed, size nor step may matter.
TEST(EverydayRigidRolling, AtAnySpeedSizeAndStep) {
  test::Cases cases(11);  // 4 of 42
  for (const test::EverydayShape& shape : test::shapes_that_roll()) {
    for (const double speed : {0.3, 3.0, 12.0, 25.0})
      if (cases.takes()) expect_steady(shape, Support::tiles, 1, speed);
    for (const double size : {0.01, 20.0})
      if (cases.takes()) expect_steady(shape, Support::static_box, size, 3);
    if (cases.takes()) expect_steady(shape, Support::static_box, 1, 6, 1e-3);
  }
}

// a = g sin(angle) / (1 + I / (m r^2)), from rest, on an inclined box. The body must roll without slipping:
// tan(angle) = 0.58 is below the friction of 0.8.
TEST(EverydayRigidRolling, DownASlopeItHasTheTextbookAcceleration) {
  constexpr double angle = 30 * EIGEN_PI / 180, gravity = 9.8;
  for (const test::EverydayShape& shape : test::shapes_that_roll()) {
    scene::Scene scene;
    test::add_support(scene, Support::static_box, 1);
    test::add_shape(scene, shape, 1, 0);
    const Quat turn = exponential(Vec3(0, 0, -angle));
    for (scene::RigidBody& body : scene.rigid) {
      body.placement.position = turn * body.placement.position;
      body.placement.orientation = turn * body.placement.orientation;
      body.friction = 0.8;
    }
    scene.gravity = Vec3(0, -gravity, 0);
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 1; frame <= seconds * scene.fps; ++frame) simulation.advance_frame();
    const auto& properties =
        simulation.world().bodies.rigid.properties[test::index_of_shape(simulation.world().bodies)];
    // All shapes but the ball, whose moments are equal, turn about the y axis of their body frame.
    const double ratio = properties.inertia.y() / (properties.mass * shape.height * shape.height);
    const double theory = gravity * std::sin(angle) / (1 + ratio) * seconds;
    const double speed = simulation.world()
                             .bodies.rigid.state[test::index_of_shape(simulation.world().bodies)]
                             .velocity.norm();
    test::expect_below(std::abs(speed / theory - 1), 1e-3, "speed_" + shape.name);
  }
}

// A body that starts to slide without turning rolls once friction has taken the fraction 1 / (1 + m r^2 / I)
// of its speed, so that v = v_0 / (1 + I / (m r^2)), whatever the friction.
TEST(EverydayRigidRolling, SlidingTurnsIntoRolling) {
  test::Cases cases(4);  // 5 of 18
  for (const test::EverydayShape& shape : test::shapes_that_roll())
    for (const Support support : {Support::ground, Support::static_box, Support::tiles}) {
      if (!cases.takes()) continue;
      scene::Scene scene;
      test::add_support(scene, support, 1);
      test::add_shape(scene, shape, 1, 0).placement.velocity = Vec3(4, 0, 0);
      scene.gravity = Vec3(0, -9.8, 0);
      Simulation simulation(scene, test::plan(scene));
      for (int frame = 1; frame <= seconds * scene.fps; ++frame) simulation.advance_frame();
      const auto& properties =
          simulation.world().bodies.rigid.properties[test::index_of_shape(simulation.world().bodies)];
      const double ratio = properties.inertia.y() / (properties.mass * shape.height * shape.height);
      const double speed =
          simulation.world().bodies.rigid.state[test::index_of_shape(simulation.world().bodies)].velocity.x();
      test::expect_below(std::abs(speed * (1 + ratio) / 4 - 1), 1e-3,
                         "speed_" + shape.name + "_" + name_of(support));
    }
}

}  // namespace
}  // namespace duet::everyday_rigid_rolling_test
