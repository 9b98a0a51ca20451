// Results are invariant under rotation, translation and reflection of the whole scene, at every accuracy: no
// direction of space is special.
#include <array>
#include <cmath>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/scene/schema.h"
#include "sim/step/world.h"

namespace duet::everyday_rigid_turned_test {
namespace {

using test::Support;

constexpr double gravity = 9.8;  // m/s^2

// A rigid motion or reflection of a scene: reflected at x = 0, rotated, translated, in this order.
struct Place {
  std::string name;
  bool is_mirrored = false;
  Vec3 turn = Vec3::Zero();  // rotation vector, rad
  Vec3 move = Vec3::Zero();  // m

  // Maps directions and velocities.
  Vec3 direction(const Vec3& v) const {
    return exponential(turn) * (is_mirrored ? Vec3(-v.x(), v.y(), v.z()) : v);
  }
  // Maps positions.
  Vec3 position(const Vec3& x) const { return direction(x) + move; }
  // Maps axial vectors, such as angular velocities. A reflection keeps their component along its normal and
  // negates the others.
  Vec3 axial(const Vec3& w) const { return (is_mirrored ? -1.0 : 1.0) * direction(w); }
  // Maps orientations. The reflection of a rotation is conjugated by the mirror.
  Quat orientation(const Quat& q) const {
    return exponential(turn) * (is_mirrored ? Quat(q.w(), q.x(), -q.y(), -q.z()) : q);
  }
  // Inverse of direction().
  Vec3 back(const Vec3& v) const {
    const Vec3 turned = exponential(-turn) * v;
    return is_mirrored ? Vec3(-turned.x(), turned.y(), turned.z()) : turned;
  }
};

// Returns the placements that every case is tested in.
const std::array<Place, 4>& places() {
  static const std::array<Place, 4> all{
      {{.name = "as it is"},
       {.name = "mirrored", .is_mirrored = true},
       {.name = "turned", .turn = Vec3(0.9, -1.7, 0.4), .move = Vec3(30, 7, -12)},
       {.name = "turned and mirrored",
        .is_mirrored = true,
        .turn = Vec3(-2.2, 0.3, 1.1),
        .move = Vec3(-300, 40, 90)}}};
  return all;
}

// Accuracies that every case is tested with.
constexpr std::array accuracies{scene::Accuracy::draft, scene::Accuracy::standard, scene::Accuracy::fine};

// A running scene and its placement.
struct Thrown {
  Simulation simulation;
  const Place& place;
  Vec3 start;

  const RigidState& state() const {
    const Bodies& bodies = simulation.world().bodies;
    return bodies.rigid.state[test::index_of_shape(bodies)];
  }
  const RigidProperties& properties() const {
    const Bodies& bodies = simulation.world().bodies;
    return bodies.rigid.properties[test::index_of_shape(bodies)];
  }
  // Displacement since the start, mapped back to the scene as it was.
  Vec3 moved() const { return place.back(state().pose.position - start); }
  // Velocity, mapped back.
  Vec3 velocity() const { return place.back(state().velocity); }
};

// How the body starts.
struct Motion {
  double above = 0;  // m
  Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();
  double friction = 0.5, restitution = 0.5, slope = 0;  // slope in rad, of gravity towards +x
};

// Builds the scene, places it, and returns its simulation.
Thrown start(const test::EverydayShape& shape, Support support, const Motion& motion, const Place& place,
             scene::Accuracy accuracy) {
  scene::Scene scene;
  scene.solver = scene::preset(accuracy);
  test::add_support(scene, support, 1);
  scene::RigidBody& body = test::add_shape(scene, shape, 1, motion.above);
  body.placement.velocity = motion.velocity;
  body.placement.angular_velocity = motion.spin;
  scene.gravity = place.direction(gravity * Vec3(std::sin(motion.slope), -std::cos(motion.slope), 0));
  for (scene::RigidBody& each : scene.rigid) {
    each.friction = motion.friction;
    each.restitution = motion.restitution;
    scene::Placement& at = each.placement;
    at = {.position = place.position(at.position),
          .orientation = place.orientation(at.orientation),
          .velocity = place.direction(at.velocity),
          .angular_velocity = place.axial(at.angular_velocity)};
  }
  const Vec3 at = scene.rigid.back().placement.position;
  return {Simulation(scene, test::plan(scene)), place, at};
}

// Calls `check` for every accuracy, placement and shape.
template <class Check>
void for_each_place(const std::vector<test::EverydayShape>& shapes, Support support, Check&& check) {
  for (const scene::Accuracy accuracy : accuracies)
    for (const Place& place : places())
      for (const test::EverydayShape& shape : shapes) {
        SCOPED_TRACE(fmt::format("{} on {}, {}, accuracy {}", shape.name, name_of(support), place.name,
                                 static_cast<int>(accuracy)));
        check(shape, place, accuracy);
      }
}

// Number of frames of a case.
constexpr int frames = 12;
constexpr double seconds = frames / 24.0;

// Speed, height and line stay, to 1e-4, 1e-4 and 1e-3, as in EverydayRigidRolling.
TEST(EverydayRigidTurned, RollingKeepsItsSpeed) {
  test::Cases cases(7);  // 21 of 144
  for (const Support support : {Support::static_box, Support::mesh})
    for_each_place(test::shapes_that_roll(), support,
                   [&](const test::EverydayShape& shape, const Place& place, scene::Accuracy accuracy) {
                     if (!cases.takes()) return;
                     const double speed = 3;
                     Thrown run =
                         start(shape, support,
                               {.velocity = Vec3(speed, 0, 0), .spin = Vec3(0, 0, -speed / shape.height)},
                               place, accuracy);
                     for (int frame = 0; frame < frames; ++frame) {
                       run.simulation.advance_frame();
                       EXPECT_LT(std::abs(run.moved().y()), 1e-4 * shape.height);
                       EXPECT_NEAR(run.velocity().x(), speed, 1e-4 * speed);
                     }
                     EXPECT_LT(std::abs(run.moved().z()), 1e-3 * shape.height);
                   });
}

// a = g sin(slope) / (1 + I / (m r^2)).
TEST(EverydayRigidTurned, DownASlopeItHasTheTextbookAcceleration) {
  test::Cases cases(5);
  for_each_place(test::shapes_that_roll(), Support::static_box,
                 [&](const test::EverydayShape& shape, const Place& place, scene::Accuracy accuracy) {
                   if (!cases.takes()) return;
                   Thrown run =
                       start(shape, Support::static_box, {.friction = 0.8, .slope = 0.5}, place, accuracy);
                   for (int frame = 0; frame < frames; ++frame) run.simulation.advance_frame();
                   const RigidProperties& body = run.properties();
                   const double ratio = body.inertia.y() / (body.mass * shape.height * shape.height);
                   const double expected = gravity * std::sin(0.5) / (1 + ratio) * seconds;
                   EXPECT_NEAR(run.velocity().x(), expected, 1e-3 * expected);
                   EXPECT_LT(std::abs(run.velocity().z()), 1e-3 * expected);
                 });
}

// The speed of rebound is e times that of impact. Sideways motion and spin are bounded as in
// EverydayRigidLanding.
TEST(EverydayRigidTurned, LandingIsLevelAndReboundsAsGiven) {
  test::Cases cases(7);
  for_each_place(test::shapes_that_lie_flat(), Support::static_box,
                 [&](const test::EverydayShape& shape, const Place& place, scene::Accuracy accuracy) {
                   if (!cases.takes()) return;
                   const double above = 0.2, impact = std::sqrt(2 * gravity * above);
                   Thrown run = start(shape, Support::static_box, {.above = above}, place, accuracy);
                   const double fall = impact / gravity;
                   for (int frame = 1; frame <= std::floor(1.6 * fall * 24); ++frame)
                     run.simulation.advance_frame();
                   const double height = run.moved().y() + above, up = run.velocity().y();
                   EXPECT_NEAR(std::sqrt(up * up + 2 * gravity * height) / impact, 0.5, 0.005);
                   EXPECT_LT(std::hypot(run.velocity().x(), run.velocity().z()), 1e-6 * impact);
                   EXPECT_LT(run.state().angular_velocity.norm(), 1e-5 * impact);
                 });
}

// The distance is v^2 / (2 mu g) along the initial direction; 0.4 % is the error of the step in which the
// body stops.
TEST(EverydayRigidTurned, SlidingStopsWhereCoulombSays) {
  std::vector<test::EverydayShape> flat;
  for (const test::EverydayShape& shape : test::shapes_that_lie_flat())
    if (shape.name != "ball" && !shape.name.starts_with("lying")) flat.push_back(shape);
  test::Cases cases(7);
  for_each_place(flat, Support::static_box,
                 [&](const test::EverydayShape& shape, const Place& place, scene::Accuracy accuracy) {
                   if (!cases.takes()) return;
                   const double speed = 1;
                   Thrown run =
                       start(shape, Support::static_box,
                             {.velocity = speed * Vec3(0.8, 0, 0.6), .friction = 0.3}, place, accuracy);
                   for (int frame = 0; frame < frames; ++frame) run.simulation.advance_frame();
                   const double expected = speed * speed / (2 * 0.3 * gravity);
                   const Vec3 moved = run.moved(), way = moved.dot(Vec3(0.8, 0, 0.6)) * Vec3(0.8, 0, 0.6);
                   EXPECT_NEAR(way.norm(), expected, 0.004 * expected);
                   EXPECT_LT((moved - way).norm(), 1e-4 * expected);
                   EXPECT_LT(run.state().velocity.norm(), 1e-6);
                 });
}

}  // namespace
}  // namespace duet::everyday_rigid_turned_test
