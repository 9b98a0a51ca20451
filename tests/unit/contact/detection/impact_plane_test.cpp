#include "sim/contact/detection/impact_plane.h"

#include <cmath>

#include "tests/support/contacts.h"
#include <gtest/gtest.h>

namespace duet::impact_plane_test {
namespace {

// Returns a ball with a radius of 0.5 m whose center is `height` (m) above the top of a static box. The box
// begins at x = 0, 0.3 m ahead of the ball's center.
scene::Scene ball_beside_box(const Vec3& velocity, double height) {
  scene::Scene scene = test::free_space();
  scene::RigidBody& box = test::add_box(scene, "box", Vec3(2, -1, 0), Vec3(4, 2, 4), 1);
  box.is_static = true;
  scene::RigidBody ball;
  ball.name = "ball";
  ball.shape = {.kind = scene::ShapeKind::sphere, .radius = 0.5};
  ball.density = 1000;
  ball.placement.position = Vec3(-0.3, height, 0);
  ball.placement.velocity = velocity;
  scene.rigid.push_back(ball);
  return scene;
}

// Returns the contact of the ball with the box after looking ahead by `dt` (s).
ContactPoint ahead(const scene::Scene& scene, double dt) {
  test::ContactScene contacts(scene, dt);
  VelocityState velocity;
  store_velocities(contacts.bodies, velocity);
  find_impact_planes(contacts.bodies, velocity, dt, OrientationUpdate::exact, 0.1, contacts.contacts);
  for (const ContactPoint& contact : contacts.contacts.points)
    if (contact.meets_ahead) return contact;
  return {};
}

// A ball that is level with the top and comes from beside the box meets the top and not its edge, so that it
// rolls on without a jolt.
TEST(ImpactPlane, IsTheTopThatABallRollsOnto) {
  const ContactPoint contact = ahead(ball_beside_box(Vec3(10, 0, 0), 0.5), 0.1);
  ASSERT_TRUE(contact.meets_ahead);
  EXPECT_TRUE(contact.is_level_ahead);
  EXPECT_LT((contact.normal - Vec3::UnitY()).norm(), 1e-12);
  EXPECT_NEAR(contact.gap, 0, 1e-12);
}

// A ball that ends the step a little above or below the top has that gap there, also if it is within what
// counts as level: at zero, rounding would decide whether it strikes in this step.
TEST(ImpactPlane, KeepsTheGapAtTheEndOfTheStep) {
  for (const double end : {-5e-5, -1e-9, 0.0, 1e-9, 5e-5}) {
    const scene::Scene scene = ball_beside_box(Vec3(10, end / 0.1, 0), 0.5);
    test::ContactScene contacts(scene, 0.1);
    const ContactPoint contact = ahead(scene, 0.1);
    ASSERT_TRUE(contact.meets_ahead);
    EXPECT_NEAR(touch_ahead(contacts.bodies, contact, 0.1, Vec3::Zero()).gap, end, 1e-12);
  }
}

// The ball, whose center is at the height h = 0.3 m, meets the edge of the box with its normal along the line
// from the edge to its center: (-d, h) / 0.5 with d^2 + h^2 = 0.5^2.
TEST(ImpactPlane, IsTheOneAtTheEdgeThatABallHits) {
  const double height = 0.3, distance = std::sqrt(0.5 * 0.5 - height * height);
  scene::Scene scene = ball_beside_box(Vec3(10, 0, 0), height);
  scene.rigid[1].placement.position.x() = -0.7;
  const ContactPoint contact = ahead(scene, 0.1);
  ASSERT_TRUE(contact.meets_ahead);
  EXPECT_FALSE(contact.is_level_ahead);
  // The meeting is noticed when the ball is 1e-4 of its size deep, hence the bounds.
  EXPECT_LT((contact.normal - Vec3(-distance, height, 0) / 0.5).norm(), 1e-3);
  EXPECT_NEAR(contact.gap, (0.7 - distance) * distance / 0.5, 1e-3);
}

// Bodies that do not reach each other within the step keep the plane at the start of the step.
TEST(ImpactPlane, StaysThatOfNowWhereNothingIsReached) {
  EXPECT_FALSE(ahead(ball_beside_box(Vec3(0.1, 0, 0), 0.5), 0.1).meets_ahead);
  EXPECT_FALSE(ahead(ball_beside_box(Vec3(0, 10, 0), 0.5), 0.1).meets_ahead);
}

// A box slides along the rim of two bars in a row. It reaches over the rim, and its underside is 1 cm below
// it. The front of the box must not hit the corner of the second bar, which it passes along the rim: points
// that would be hit along their own surface get an infinite gap. Others come under the box.
TEST(ImpactPlane, IsNoneOfPointsThatAreHitAlongTheirEdge) {
  scene::Scene scene = test::free_space();
  test::add_box(scene, "box", Vec3(0, 0.49, 1), Vec3(1, 1, 1), 1).placement.velocity = Vec3(10, 0, 0);
  test::add_box(scene, "first", Vec3(-3, -0.5, 0), Vec3(7.5, 1, 2), 1).is_static = true;
  test::add_box(scene, "second", Vec3(4.75, -0.5, 0), Vec3(8, 1, 2), 1).is_static = true;
  test::ContactScene contacts(scene, 0.1);
  VelocityState velocity;
  store_velocities(contacts.bodies, velocity);
  find_impact_planes(contacts.bodies, velocity, 0.1, OrientationUpdate::exact, 0.1, contacts.contacts);
  int passed = 0;
  for (const ContactPoint& contact : contacts.contacts.points) {
    if (!contact.meets_ahead || contact.guest_rigid != 2) continue;
    if (std::isfinite(contact.gap))
      EXPECT_LT(std::abs(contact.normal.x()), 0.01) << contact.feature.index;
    else
      ++passed;
  }
  EXPECT_GT(passed, 0);
}

}  // namespace
}  // namespace duet::impact_plane_test
