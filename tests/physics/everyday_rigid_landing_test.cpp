// Bodies that land flat rebound without turning, in the same place, and with the speed that their restitution
// says, for any shape, support, size and step.
#include <algorithm>
#include <cmath>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/step/step.h"

namespace duet::everyday_rigid_landing_test {
namespace {

using test::Support;

constexpr double gravity = 9.8;  // m/s^2

// How a body lands.
struct Landing {
  double size = 1;  // m
  double drop = 1;  // sizes
  double restitution = 0.5;
  double friction = 0.5;
  double sideways = 0;  // over the speed of impact
  double longest_step = 1.0 / 48;
};

// Velocities and energy after the landing.
struct Left {
  double up = 0;        // speed on the way up over that on the way down, both at the surface
  double sideways = 0;  // speed along x over that on the way down
  // Speed along z over that on the way down.
  double across = 0;
  double spin = 0;    // half a size times the angular velocity, over that speed
  double energy = 0;  // relative gain
};

// Simulates the fall and the rebound, up to half of the time until the next impact, or, without restitution,
// for 0.3 of the time of the fall.
Left land(const test::EverydayShape& shape, Support support, const Landing& how) {
  scene::Scene scene;
  test::add_support(scene, support, how.size);
  scene::RigidBody& body = test::add_shape(scene, shape, how.size, how.drop * how.size);
  const double impact = std::sqrt(2 * gravity * how.drop * how.size);
  body.placement.velocity = Vec3(how.sideways * impact, 0, 0);
  for (scene::RigidBody& each : scene.rigid) {
    each.restitution = how.restitution;
    each.friction = how.friction;
  }
  if (scene.ground) {
    scene.ground->restitution = how.restitution;
    scene.ground->friction = how.friction;
  }
  scene.gravity = Vec3(0, -gravity, 0);
  scene.solver.max_time_step = how.longest_step * std::sqrt(how.size);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  const std::size_t index = test::index_of_shape(world.bodies);
  const RigidState& state = world.bodies.rigid.state[index];
  const double mass = world.bodies.rigid.properties[index].mass;
  const auto energy = [&] {
    return kinetic_energy(state, world.bodies.rigid.properties[index]) +
           mass * gravity * (state.pose.position.y() - shape.height * how.size);
  };
  const double before = energy();
  const double fall = impact / gravity;
  const double end = fall * (1 + (how.restitution > 0 ? how.restitution : 0.3));
  for (double time = 0; time < end * (1 - 1e-9);) {
    const double dt = std::min(choose_time_step(world, time), end - time);
    step(world, time, dt);
    time += dt;
  }
  const double height = state.pose.position.y() - shape.height * how.size;
  Left left;
  left.up = std::sqrt(std::max(0.0, state.velocity.y() * state.velocity.y() + 2 * gravity * height)) / impact;
  left.sideways = state.velocity.x() / impact;
  left.across = std::abs(state.velocity.z()) / impact;
  left.spin = 0.5 * how.size * state.angular_velocity.norm() / impact;
  left.energy = energy() / before - 1;
  return left;
}

// Checks a landing without sideways speed.
void expect_level(const test::EverydayShape& shape, Support support, const Landing& how) {
  const Left left = land(shape, support, how);
  const std::string name = fmt::format("{} on {}, size {}, e {}, step {}", shape.name, name_of(support),
                                       how.size, how.restitution, how.longest_step);
  SCOPED_TRACE(name);
  // Sweeps find the impulses of an impact to 1e-10 of its speed, and a level mesh of doubles is level to
  // 1e-7, the single precision of its grid.
  EXPECT_LT(left.spin, 1e-6) << name;
  EXPECT_LT(std::hypot(left.sideways, left.across), 1e-6) << name;
  EXPECT_NEAR(left.up, how.restitution, how.restitution > 0 ? 0.01 * how.restitution : 1e-3) << name;
  EXPECT_LT(left.energy, 1e-9) << name;
  if (how.restitution == 1) {
    EXPECT_GT(left.energy, -1e-3) << name;
  }
}

// The speed after the impact is e times that before. Impulses that differ among the points of a face would
// turn the body.
TEST(EverydayRigidLanding, EveryShapeLeavesLevelWithItsRestitution) {
  test::Cases cases(5);
  for (const test::EverydayShape& shape : test::shapes_that_lie_flat())
    for (const double restitution : {0.0, 0.5, 1.0})
      for (const double friction : {0.0, 0.5})
        if (cases.takes())
          expect_level(shape, Support::ground, {.restitution = restitution, .friction = friction});
}

// The support must not matter, nor the internal edges of tiles and meshes.
TEST(EverydayRigidLanding, WhateverItLandsOn) {
  test::Cases cases(5);  // 7 of 32
  for (const test::EverydayShape& shape : test::shapes_that_lie_flat())
    for (const Support support : {Support::static_box, Support::tiles, Support::mesh, Support::kinematic_box})
      if (cases.takes()) expect_level(shape, support, {});
}

// Neither size nor step may matter. Absolute thresholds of speeds or lengths in the solver would show at the
// ends of the range.
TEST(EverydayRigidLanding, AtAnySizeAndStep) {
  test::Cases cases(5);
  for (const test::EverydayShape& shape : test::shapes_that_lie_flat())
    for (const double size : {1e-2, 0.2, 30.0})
      for (const double longest_step : {1.0 / 48, 1.0 / 300, 1e-3})
        if (cases.takes()) expect_level(shape, Support::ground, {.size = size, .longest_step = longest_step});
}

// A rebound that is lower than the way of the last step before it must not be lost, whatever the fraction of
// the step after which the bodies meet.
TEST(EverydayRigidLanding, LowReboundsHaveTheirHeight) {
  test::Cases cases(5);
  for (const test::EverydayShape& shape : test::shapes_that_lie_flat())
    for (const double restitution : {0.1, 0.2, 0.4})
      for (const double drop : {0.5, 0.6, 0.75, 1.1, 3.0})
        if (cases.takes()) expect_level(shape, Support::ground, {.drop = drop, .restitution = restitution});
}

// The impulse m (1 + e) v along the normal brings friction of mu times that, evenly over all points. A body
// that lands flat with a sideways speed loses mu (1 + e) v of it, and neither turns nor leaves its line.
TEST(EverydayRigidLanding, FrictionOfABlowIsThatOfCoulomb) {
  for (const test::EverydayShape& shape : test::shapes_that_lie_flat()) {
    if (shape.name.starts_with("lying") || shape.name == "ball" || shape.name == "slab")
      continue;  // they roll or tip
    const Left left = land(shape, Support::ground, {.restitution = 0, .friction = 0.1, .sideways = 0.5});
    // After the landing the body slides with friction for 0.3 of the time of the fall.
    test::expect_below(std::abs(left.sideways - (0.5 - 0.1 - 0.1 * 0.3)), 2e-3, "speed_" + shape.name);
    test::expect_below(left.across, 1e-6, "across_" + shape.name);
  }
}

// In a row of touching balls with e = 1, the last ball leaves with the whole speed of the first, and all
// others rest. Solving all impacts at once would share the momentum among several balls.
TEST(EverydayRigidLanding, ARowOfBallsPassesABlowOn) {
  for (const int count : {3, 5, 9}) {
    scene::Scene scene = test::free_space();
    for (int i = 0; i < count; ++i) {
      scene::RigidBody& ball =
          test::add_ball(scene, fmt::format("ball{}", i), Vec3(i == 0 ? -0.5 : i, 0, 0), 0.5, 2);
      ball.restitution = 1;
      ball.friction = 0;
    }
    scene.rigid[0].placement.velocity = Vec3(3, 0, 0);
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
    const auto& state = simulation.world().bodies.rigid.state;
    test::expect_below(std::abs(state.back().velocity.x() - 3), 1e-9, fmt::format("last_of_{}", count));
    for (int i = 0; i + 1 < count; ++i) EXPECT_LT(state[static_cast<std::size_t>(i)].velocity.norm(), 1e-9);
  }
}

}  // namespace
}  // namespace duet::everyday_rigid_landing_test
