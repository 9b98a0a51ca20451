// Friction of flat faces: against spin it has the lever arm of even pressure, it brakes sliding equally in
// every direction, and at no contact does it exceed the coefficient.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/step/world.h"

namespace duet::everyday_rigid_friction_test {
namespace {

using test::Support;

constexpr double friction = 0.3, gravity = 9.8;

// A body that lies on a flat face or along a line.
struct Face {
  test::EverydayShape shape;
  double lever;         // for the size 1, in m: mean distance of the points of the face from its middle
  double unit_inertia;  // m^2, moment of inertia about the normal over the mass, for the size 1
  double tolerance;
};

// Returns the moment of inertia over the mass (m^2) of a capsule about a line across its middle: that of its
// cylinder and of its two half balls, weighted by their volumes.
double unit_inertia_of_capsule(double radius, double length) {
  const double r = radius, l = length, ends = 4.0 / 3 * r, whole = l + ends;  // volumes over pi r^2
  return (l * (l * l / 12 + r * r / 4) + ends * (0.4 * r * r + l * l / 4 + 0.375 * l * r)) / whole;
}

// Returns bodies on flat faces. The mean distance from the middle is (side/6) (sqrt 2 + ln(1 + sqrt 2)) for a
// square, 2/3 of the radius for a disc, the radius for a circle, and a quarter of its length for a line. A
// disc has the lever arm of the polygon of its samples, and so a larger tolerance.
std::vector<Face> faces() {
  using scene::ShapeKind;
  const double square = (std::sqrt(2.0) + std::log(1 + std::sqrt(2.0))) / 6;
  const auto cube = std::make_shared<TriangleMesh>(test::box_mesh(-Vec3(0.5, 0.5, 0.5), Vec3(0.5, 0.5, 0.5)));
  return {
      {{"cube", {.kind = ShapeKind::box, .size = Vec3(1, 1, 1)}, Quat::Identity(), 0.5},
       square,
       1.0 / 6,
       0.01},
      {{"slab", {.kind = ShapeKind::box, .size = Vec3(1, 0.1, 1)}, Quat::Identity(), 0.05},
       square,
       1.0 / 6,
       0.01},
      {{"disc", {.kind = ShapeKind::cylinder, .radius = 0.5, .length = 0.1}, Quat::Identity(), 0.05},
       1.0 / 3,
       0.125,
       0.015},
      {{"can", {.kind = ShapeKind::cylinder, .radius = 0.5, .length = 1}, Quat::Identity(), 0.5},
       1.0 / 3,
       0.125,
       0.015},
      {{"ring", {.kind = ShapeKind::torus, .radius = 0.4, .tube = 0.1}, Quat::Identity(), 0.1},
       0.4,
       0.16 + 0.0075,
       0.01},
      {{"mesh", {.kind = ShapeKind::mesh}, Quat::Identity(), 0.5, cube}, square, 1.0 / 6, 0.01},
  };
}

// Returns bodies that touch along a line.
std::vector<Face> lines() {
  using scene::ShapeKind;
  const Quat lying = exponential(Vec3(0, 0, std::numbers::pi / 2));
  return {
      {{"log", {.kind = ShapeKind::cylinder, .radius = 0.1, .length = 1}, lying, 0.1},
       0.25,
       (0.03 + 1) / 12,
       0.01},
      {{"pill", {.kind = ShapeKind::capsule, .radius = 0.1, .length = 1}, lying, 0.1},
       0.25,
       unit_inertia_of_capsule(0.1, 1),
       0.01},
  };
}

// Returns all bodies of both kinds.
std::vector<Face> faces_and_lines() {
  std::vector<Face> all = faces();
  for (const Face& line : lines()) all.push_back(line);
  return all;
}

// Returns a scene with the support, friction, and a gravity that is proportional to `size`, so that motions
// take the same time at any size.
scene::Scene on(Support support, double size) {
  scene::Scene scene;
  test::add_support(scene, support, size);
  scene.gravity = Vec3(0, -gravity * size, 0);
  if (scene.ground) scene.ground->friction = friction;
  for (scene::RigidBody& body : scene.rigid) body.friction = friction;
  return scene;
}

// Checks the spin after 9 frames against even pressure, w' = -mu g r / i with r the lever arm and i the
// inertia over the mass, and that the body has stopped after 18 frames close to where it started.
void expect_even_pressure(const Face& face, Support support, double size, double longest_step) {
  scene::Scene scene = on(support, size);
  scene::RigidBody& body = test::add_shape(scene, face.shape, size, 0);
  body.friction = friction;
  body.restitution = 0;
  // The body stands off the middle and turned, so that its points lie irregularly over those of the support.
  body.placement.position += size * Vec3(0.31, 0, 0.17);
  body.placement.orientation = exponential(Vec3(0, 0.4, 0)) * body.placement.orientation;
  const Vec3 start = body.placement.position;
  const double deceleration = friction * gravity * face.lever / face.unit_inertia, spin = 0.5 * deceleration;
  body.placement.angular_velocity = Vec3(0, spin, 0);
  scene.solver.max_time_step = longest_step;
  Simulation simulation(scene, test::plan(scene));
  const RigidState& state =
      simulation.world().bodies.rigid.state[test::index_of_shape(simulation.world().bodies)];
  for (int frame = 0; frame < 9; ++frame) simulation.advance_frame();
  const double expected = spin - deceleration * 9 / scene.fps;
  const std::string name =
      fmt::format("{} on {}, size {}, step {}", face.shape.name, name_of(support), size, longest_step);
  EXPECT_NEAR((spin - state.angular_velocity.y()) / (spin - expected), 1, face.tolerance) << name;
  for (int frame = 0; frame < 9; ++frame) simulation.advance_frame();
  EXPECT_LT(state.angular_velocity.norm(), 1e-3 * spin) << name;
  EXPECT_LT((state.pose.position - start).norm(), 0.01 * size) << name;
}

// Load that is spread unevenly over redundant points changes the lever arm, by 10 % and more where sweeps
// alone decide.
TEST(EverydayRigidFriction, ASpinningFaceStopsAsUnderEvenPressure) {
  test::Cases cases(3);
  for (const Face& face : faces_and_lines())
    for (const Support support :
         {Support::ground, Support::static_box, Support::mesh, Support::kinematic_box, Support::dynamic_box})
      if (cases.takes()) expect_even_pressure(face, support, 1, 1.0 / 48);
}

// Motions are the same at any size, because gravity is proportional to it, and with shorter steps.
TEST(EverydayRigidFriction, AtAnySizeAndStep) {
  test::Cases cases(2);
  for (const Face& face : faces_and_lines())
    for (const auto& [size, step] : {std::pair(0.01, 1.0 / 48), {20.0, 1.0 / 48}, {1.0, 2e-3}})
      if (cases.takes()) expect_even_pressure(face, Support::static_box, size, step);
}

// Checks the distance of sliding, v^2 / (2 mu g), for directions at `angles` (rad) from x. The direction may
// change the distance by 1e-4 of it, and the body must not leave its line. The error of 2e-3 is that of the
// step within which it stops.
void expect_to_slide(const Face& face, Support support, std::span<const double> angles) {
  double least = 1e9, most = 0;
  for (const double angle : angles) {
    scene::Scene scene = on(support, 1);
    scene::RigidBody& body = test::add_shape(scene, face.shape, 1, 0);
    body.friction = friction;
    body.placement.position.x() += 3;
    const Vec3 start = body.placement.position, way(std::cos(angle), 0, std::sin(angle));
    body.placement.velocity = 2 * way;
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
    const auto b = test::index_of_shape(simulation.world().bodies);
    const Vec3 moved = simulation.world().bodies.rigid.state[b].pose.position - start;
    least = std::min(least, moved.dot(way));
    most = std::max(most, moved.dot(way));
    EXPECT_LT((moved - moved.dot(way) * way).norm(), 1e-4) << face.shape.name << ", " << angle;
  }
  const double expected = 4 / (2 * friction * gravity);
  EXPECT_LT(most - least, 1e-4 * expected) << face.shape.name << " on " << name_of(support);
  EXPECT_NEAR(most, expected, 2e-3 * expected) << face.shape.name << " on " << name_of(support);
}

// Friction with a pyramid in place of a cone, or with separate bounds along two axes, would depend on the
// direction by up to 40 %.
TEST(EverydayRigidFriction, SlidingIsTheSameFromEveryDirection) {
  test::Cases cases(5);
  for (const Face& face : faces())
    for (const Support support : {Support::ground, Support::static_box, Support::mesh})
      if (cases.takes()) expect_to_slide(face, support, std::array{0.0, 0.2, 0.7, 1.3, 2.0, 3.0});
}

// A body on a line slides along that line; across it, it would roll.
TEST(EverydayRigidFriction, LinesSlideAlongThemselves) {
  for (const Face& line : lines())
    for (const Support support : {Support::ground, Support::static_box, Support::mesh})
      expect_to_slide(line, support, std::array{0.0, std::numbers::pi});
}

// Checks |t| <= mu n for the impulses of all contacts of a heap while it falls, slides and comes to rest,
// with 1e-6 of n for rounding.
TEST(EverydayRigidFriction, NoContactLeavesItsCone) {
  scene::Scene scene = test::on_ground(friction);
  int i = 0;
  for (const test::EverydayShape& shape : test::shapes_that_lie_flat())
    for (const double above : {0.1, 1.5}) {
      scene::RigidBody& body = test::add_shape(scene, shape, 0.5, above);
      body.name += std::to_string(i);
      body.friction = 0.1 * (i % 5);
      body.placement.position += Vec3(0.7 * (i % 4), 0, 0.7 * (i / 4));
      body.placement.velocity = Vec3(0.5 * (i % 3), 0, 1 - 0.4 * (i % 6));
      ++i;
    }
  Simulation simulation(scene, test::plan(scene));
  std::size_t seen = 0;
  double most = 0;
  for (int frame = 0; frame < 36; ++frame) {
    simulation.advance_frame();
    for (const ContactPoint& contact : simulation.world().context.contact.contacts.points) {
      const double normal = contact.impulse.dot(contact.normal);
      const double tangential = (contact.impulse - normal * contact.normal).norm();
      if (contact.impulse.isZero(0)) continue;
      ++seen;
      most = std::max(most, tangential - contact.friction * normal - 1e-6 * normal);
    }
  }
  EXPECT_LE(most, 0);
  EXPECT_GT(seen, 300u);
}

}  // namespace
}  // namespace duet::everyday_rigid_friction_test
