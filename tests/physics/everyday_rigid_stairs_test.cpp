// Bodies that go over the edges of steps: what is symmetric stays on its line, however often it falls onto
// the next step, and no edge sinks into another body.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/simulation/simulation.h"

namespace duet::everyday_rigid_stairs_test {
namespace {

constexpr double rise = 0.6, tread = 1.5, width = 4.5;  // m, of the stairs for bodies of the size 1

// Returns stairs that lead down along x, for bodies of the size `size` (m). The top of the first of `steps`
// steps is at y = 0 and ends at x = 2 sizes, and the ground is below the last one. Times are those of the
// size 1.
scene::Scene stairs(int steps, double size, double restitution) {
  scene::Scene scene = test::on_ground(0.5, restitution);
  scene.gravity *= size;
  scene.ground->height = -rise * size * steps;
  for (int i = 0; i < steps; ++i) {
    const double height = rise * (steps - i), depth = i == 0 ? 3 : tread,
                 middle = i == 0 ? 0.5 : 2 + tread * (i - 0.5);
    scene::RigidBody& step =
        test::add_box(scene, fmt::format("step{}", i), size * Vec3(middle, -rise * steps + height / 2, 0),
                      size * Vec3(depth, height, width), 1);
    step.mass.reset();
    step.is_static = true;
    step.friction = 0.5;
    step.restitution = restitution;
  }
  return scene;
}

// How far a body leaves the plane z = 0, over its size, and how deep bodies overlap, over its size.
struct Seen {
  double off = 0, turned = 0, depth = 0;
};

Seen watch(const scene::Scene& scene, double size, int frames) {
  Simulation simulation(scene, test::plan(scene));
  const std::size_t index = test::index_of_shape(simulation.world().bodies);
  Seen seen;
  for (int frame = 0; frame < frames; ++frame) {
    simulation.advance_frame();
    const RigidState& state = simulation.world().bodies.rigid.state[index];
    seen.off = std::max(seen.off, std::abs(state.pose.position.z()) / size);
    seen.turned = std::max(seen.turned, std::hypot(state.angular_velocity.x(), state.angular_velocity.y()));
    seen.depth = std::max(seen.depth, simulation.stats().max_penetration / size);
  }
  return seen;
}

}  // namespace

// What rolls down stairs with its axis along their edges stays on its line. The two ends of its line of
// contact roll around an edge alike; if a sample or a place between them took load on one side, a can would
// turn by 0.06 rad/s on the first edge, and would leave its line by its own length. The bounds leave room for
// what the solves leave over, by which coins tilt and steer.
TEST(EverydayRigidStairs, WhatRollsDownStaysOnItsLine) {
  test::Cases cases(3);
  std::vector<test::EverydayShape> shapes = test::shapes_that_roll();
  const Quat across = exponential(Vec3(EIGEN_PI / 2, 0, 0));
  shapes.push_back(
      {"can", {.kind = scene::ShapeKind::cylinder, .radius = 0.45, .length = 1.5}, across, 0.45});
  for (const test::EverydayShape& shape : shapes)
    for (const int steps : {1, 4})
      for (const double restitution : {0.0, 0.5})
        for (const double step : {0.0, 2e-3})
          for (const double size : {1.0, 0.01, 20.0}) {
            if (!cases.takes()) continue;
            scene::Scene scene = stairs(steps, size, restitution);
            if (step > 0) scene.solver.max_time_step = step;
            scene::RigidBody& body = test::add_shape(scene, shape, size, 0);
            body.placement.position.x() = size;
            body.placement.velocity.x() = 3 * size;
            body.placement.angular_velocity.z() = -3 / shape.height;
            body.friction = 0.5;
            body.restitution = restitution;
            const Seen seen = watch(scene, size, 48);
            const std::string what = fmt::format("{} of {} m, {} steps, restitution {}, steps of {} s",
                                                 shape.name, size, steps, restitution, step);
            test::expect_below(seen.off, 3e-3, "distance from the line of " + what);
            test::expect_below(seen.turned, 5e-3, "turning (rad/s) of " + what);
            test::expect_below(seen.depth, 1e-4, "depth of " + what);
          }
}

// A fast box that passes over the edge of a step comes to be above it in the step in which it lands. If edges
// that are beside a body at first were not looked at, it would sink in by a hundredth of its size.
// At 4.5 sizes a second an edge still dips in by 6e-4.
TEST(EverydayRigidStairs, FastBoxesSinkInNowhere) {
  for (const double size : {1.0, 0.01, 20.0})
    for (int i = 0; i < 11; ++i) {
      const double speed = 4.5 + 0.75 * i;
      scene::Scene scene = stairs(5, size, 0);
      scene::RigidBody& body =
          test::add_box(scene, "body", size * Vec3(0.4, 0.5, 0), size * Vec3(1, 1, 1.6), 1);
      body.mass = 1000 * size * size * size;
      body.friction = 0.1;
      body.restitution = 0;
      body.placement.velocity.x() = speed * size;
      const Seen seen = watch(scene, size, 48);
      test::expect_below(seen.depth, 1e-3,
                         fmt::format("depth of a box of {} m at {} sizes a second", size, speed));
    }
}

}  // namespace duet::everyday_rigid_stairs_test
