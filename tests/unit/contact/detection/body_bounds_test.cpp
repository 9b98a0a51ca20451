#include "sim/contact/detection/body_bounds.h"

#include <cmath>

#include <gtest/gtest.h>

namespace duet::body_bounds_test {
namespace {

BodyBounds ball(const Vec3& center, double radius, const Vec3& velocity) {
  BodyBounds bounds;
  bounds.center = center;
  bounds.radius = radius;
  bounds.velocity = velocity;
  return bounds;
}

// A ball above another one: v t + g t^2 = way, where the way is what they are apart less half of the depth.
TEST(TimeApart, IsTheTimeOfASpeedThatGravityAddsTo) {
  for (const double size : {1e-4, 1.0, 1e3})
    for (const double v : {-2.0, -1e-3, 0.0, 1e-3, 5.0})
      for (const double g : {0.0, 1.6, 9.8}) {
        const BodyBounds below = ball(Vec3::Zero(), size, Vec3::Zero());
        const BodyBounds above = ball(Vec3(0, 3 * size, 0), size, Vec3(0, -v, 0));
        const double depth = 0.1 * size, way = size - depth / 2;
        const double t = time_apart(below, above, depth, Vec3(0, -g, 0));
        if (v <= 0 && g == 0)
          EXPECT_TRUE(std::isinf(t));
        else
          EXPECT_NEAR((v * t + g * t * t) / way, 1, 1e-9) << size << ", " << v << ", " << g;
      }
}

// Gravity along the plane between them brings them no nearer.
TEST(TimeApart, GravityCountsAcrossThePlaneBetweenThem) {
  const BodyBounds a = ball(Vec3::Zero(), 1, Vec3::Zero()), b = ball(Vec3(3, 0, 0), 1, Vec3(-2, 0, 0));
  EXPECT_NEAR(time_apart(a, b, 0.2, Vec3(0, -9.8, 0)), 0.9 / 2, 1e-12);
}

// Boxes that interlock may move by the depth, whichever way.
TEST(TimeApart, OfBodiesWithNoPlaneBetweenThemIsThatOfTheDepth) {
  BodyBounds a = ball(Vec3::Zero(), 0, Vec3(0, 3, 0)), b = ball(Vec3::Zero(), 0, Vec3::Zero());
  a.half = b.half = Vec3(1, 1, 1);
  const double g = 9.8, depth = 0.3, t = time_apart(a, b, depth, Vec3(0, -g, 0));
  EXPECT_NEAR(3 * t + g * t * t, depth, 1e-12);
}

}  // namespace
}  // namespace duet::body_bounds_test
