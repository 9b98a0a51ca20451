// A body in a groove of a mesh touches both sides: it rests there, rolls along, and comes to rest when it is
// dropped, whatever its shape, the angle of the groove, the size and the step.
#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/groove.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/step/world.h"

namespace duet::everyday_rigid_groove_test {
namespace {

// A shape of size 1 in the groove.
struct InGroove {
  std::string name;
  scene::Shape shape;  // for the size 1
  Quat orientation = Quat::Identity();
  double radius = 0;  // m, from its middle to both sides
};

// Returns round shapes that rest in the groove; capsule and cylinder have their axes along it.
std::vector<InGroove> round_shapes() {
  using scene::ShapeKind;
  const Quat along = exponential(Vec3(0, 0, EIGEN_PI / 2));
  return {{"ball", {.kind = ShapeKind::sphere, .radius = 0.3}, Quat::Identity(), 0.3},
          {"capsule", {.kind = ShapeKind::capsule, .radius = 0.3, .length = 0.8}, along, 0.3},
          {"cylinder", {.kind = ShapeKind::cylinder, .radius = 0.3, .length = 0.8}, along, 0.3}};
}

// Returns the body in a groove whose sides rise at `angle` (rad), `above` sizes above its place of rest.
// Gravity is proportional to `size`.
scene::Scene scene_of(const InGroove& body, double angle, double size, double above) {
  scene::Scene scene;
  auto mesh = std::make_shared<TriangleMesh>(test::groove(angle));
  for (Vec3& x : mesh->positions) x *= size;
  scene::RigidBody& host = test::add_mesh(scene, "groove", mesh, 1, 1);
  host.is_static = true;
  host.mass.reset();
  host.friction = 0.5;
  scene::RigidBody guest;
  guest.name = "body";
  guest.shape = test::scaled(body.shape, size);
  guest.density = 1000;
  guest.friction = 0.5;
  guest.restitution = 0;
  guest.placement.orientation = body.orientation;
  guest.placement.position = Vec3(0, size * (above + body.radius / std::cos(angle)), 0);
  scene.rigid.push_back(guest);
  scene.gravity = Vec3(0, -9.8 * size, 0);
  return scene;
}

// A contact with the nearest side alone would let the body drift into the other one.
TEST(EverydayRigidGroove, WhatLiesInItRests) {
  test::Cases cases(7);  // 4 of 27
  for (const double angle : {0.35, 0.785, 1.1})
    for (const double size : {0.02, 1.0, 15.0})
      for (InGroove body : round_shapes()) {
        if (!cases.takes()) continue;
        scene::Scene scene = scene_of(body, angle, size, 0);
        if (size == 1) scene.solver.max_time_step = 2e-3;
        const Vec3 start = scene.rigid.back().placement.position;
        Simulation simulation(scene, test::plan(scene));
        for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
        const auto b = test::index_of_shape(simulation.world().bodies);
        const RigidState& state = simulation.world().bodies.rigid.state[b];
        // The tolerance of the contact solve, 1e-6 m/s, allows for a drift of that speed over a second.
        EXPECT_LT((state.pose.position - start).norm(), 1e-6 * size + 1e-6)
            << body.name << ", " << angle << ", " << size;
        EXPECT_LT(state.velocity.norm(), 1e-6 * size + 2e-6) << body.name << ", " << angle << ", " << size;
      }
}

// At rest the body's middle is r / cos(angle) above the bottom of the groove. Bounds are measurements with a
// margin.
TEST(EverydayRigidGroove, WhatFallsIntoItComesToRestAtItsBottom) {
  test::Cases cases(2);  // 3 of 6
  for (const double angle : {0.5, 0.785})
    for (InGroove body : round_shapes()) {
      if (!cases.takes()) continue;
      scene::Scene scene = scene_of(body, angle, 1, 0.2);
      scene.rigid.back().placement.position.z() = 0.05;
      Simulation simulation(scene, test::plan(scene));
      for (int frame = 0; frame < 72; ++frame) simulation.advance_frame();
      const auto b = test::index_of_shape(simulation.world().bodies);
      const RigidState& state = simulation.world().bodies.rigid.state[b];
      EXPECT_NEAR(state.pose.position.y(), body.radius / std::cos(angle), 1e-5) << body.name << ", " << angle;
      EXPECT_NEAR(state.pose.position.z(), 0, 1e-5) << body.name << ", " << angle;
      EXPECT_LT(state.velocity.norm(), 1e-4) << body.name << ", " << angle;
    }
}

// A ball that rolls along both sides without slipping keeps speed and height; contact that changes sides
// would brake it.
TEST(EverydayRigidGroove, ABallRollsAlongIt) {
  for (const double angle : {0.35, 0.785, 1.1})
    for (const double speed : {0.5, 3.0}) {
      const InGroove ball = round_shapes()[0];
      scene::Scene scene = scene_of(ball, angle, 1, 0);
      scene::RigidBody& body = scene.rigid.back();
      body.placement.velocity = Vec3(speed, 0, 0);
      // Without slipping, the points of contact are r cos(angle) below the axis.
      body.placement.angular_velocity = Vec3(0, 0, -speed / (ball.radius * std::cos(angle)));
      const double height = body.placement.position.y();
      Simulation simulation(scene, test::plan(scene));
      const auto b = test::index_of_shape(simulation.world().bodies);
      const RigidState& state = simulation.world().bodies.rigid.state[b];
      for (int frame = 0; frame < 48; ++frame) {
        simulation.advance_frame();
        EXPECT_NEAR(state.velocity.x(), speed, 1e-4 * speed) << angle << ", " << speed << ", frame " << frame;
        EXPECT_NEAR(state.pose.position.y(), height, 1e-4 * ball.radius) << angle << ", " << speed;
        EXPECT_NEAR(state.pose.position.z(), 0, 1e-4 * ball.radius) << angle << ", " << speed;
      }
    }
}

// A cube, as a box and as a mesh, stands on its edge in a groove with a right angle, and touches both sides
// with its faces.
TEST(EverydayRigidGroove, ACubeFitsIntoARightAngle) {
  const auto cube = std::make_shared<TriangleMesh>(test::box_mesh(-Vec3(0.4, 0.3, 0.3), Vec3(0.4, 0.3, 0.3)));
  test::Cases cases(3);  // 2 of 4
  for (const bool is_mesh : {false, true})
    for (const double above : {0.0, 0.2}) {
      if (!cases.takes()) continue;
      InGroove body{"cube",
                    {.kind = scene::ShapeKind::box, .size = Vec3(0.8, 0.6, 0.6)},
                    exponential(Vec3(EIGEN_PI / 4, 0, 0)),
                    0.3};
      if (is_mesh) {
        body.shape = {.kind = scene::ShapeKind::mesh};
        body.shape.mesh = cube;
      }
      scene::Scene scene = scene_of(body, EIGEN_PI / 4, 1, above);
      Simulation simulation(scene, test::plan(scene));
      for (int frame = 0; frame < 60; ++frame) simulation.advance_frame();
      const auto b = test::index_of_shape(simulation.world().bodies);
      const RigidState& state = simulation.world().bodies.rigid.state[b];
      const Vec3 rest(0, 0.3 * std::sqrt(2.0), 0);
      EXPECT_LT((state.pose.position - rest).norm(), 1e-5) << is_mesh << ", from " << above;
      EXPECT_LT(state.velocity.norm(), 1e-4) << is_mesh << ", from " << above;
    }
}

// When a box comes to lie on one side of the groove, its edge in the bottom touches both sides. With a
// contact at one of them alone it kept velocities of 0.1 m/s that moved nothing. The test drops boxes with
// several turns, frictions and sizes; the bounds on speed and penetration are the tolerance of the contact
// solve.
TEST(EverydayRigidGroove, BoxesComeToRestInIt) {
  const Vec3 half(0.15, 0.25, 0.125);
  const auto mesh = std::make_shared<TriangleMesh>(test::box_mesh(-half, half));
  double max_gain = 0;
  test::Cases cases(13);  // 5 of 60
  for (const double angle : {0.35, 0.6, 0.785, 0.9})
    for (const double friction : {0.0, 0.01, 0.3})
      for (const double turn : {0.0, 0.1, 0.7, 1.3})
        for (const double size : turn == 0.1 ? std::vector{0.02, 15.0} : std::vector{1.0}) {
          if (!cases.takes()) continue;
          InGroove body{
              "box", {.kind = scene::ShapeKind::box, .size = 2 * half}, exponential(Vec3(turn, 0, 0))};
          scene::Scene scene = scene_of(body, angle, size, 0.7);
          scene.rigid.front().friction = scene.rigid.back().friction = friction;
          scene.rigid.back().placement.position.z() = 0.02 * size;
          if (turn == 0.7) {
            scene.rigid.back().shape = {.kind = scene::ShapeKind::mesh, .scale = 1};
            scene.rigid.back().shape.mesh = mesh;
          }
          if (turn == 1.3) scene.solver.max_time_step = 4e-3;
          Simulation simulation(scene, test::plan(scene));
          double least = std::numeric_limits<double>::infinity(), gain = 0;
          // Energy (J) of a fall by a size; gravity is proportional to the size.
          const double scale = 8 * half.prod() * 1000 * 9.8 * std::pow(size, 5);
          for (int frame = 0; frame < 96; ++frame) {
            simulation.advance_frame();
            const FrameStats stats = simulation.stats();
            const double energy = (stats.kinetic + stats.potential) / scale;
            gain = std::max(gain, energy - least);
            least = std::min(least, energy);
          }
          max_gain = std::max(max_gain, gain);
          const auto b = test::index_of_shape(simulation.world().bodies);
          const RigidState& state = simulation.world().bodies.rigid.state[b];
          const std::string name =
              fmt::format("{} rad, friction {}, turned by {}, size {}", angle, friction, turn, size);
          EXPECT_LT(state.velocity.norm(), 1e-6 * size + 2e-6) << name;
          EXPECT_LT(simulation.stats().max_penetration, 2e-6 * size) << name;
        }
  test::expect_below(max_gain, 4e-3, "most_gain");
}

}  // namespace
}  // namespace duet::everyday_rigid_groove_test
