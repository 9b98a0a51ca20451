#include "sim/contact/detection/body_bounds.h"

#include <cmath>

#include <gtest/gtest.h>

namespace duet::body_bounds_test {
namespace {

// Returns the bounds of a ball.
BodyBounds ball(const Vec3& center, double radius, const Vec3& velocity) {
  BodyBounds bounds;
  bounds.center = center;
  bounds.radius = radius;
  bounds.velocity = velocity;
  return bounds;
}

// A ball is above another one, which may fall away or stand. With the speed v downward and gravity g the time
// t solves v t + g t^2 = distance - depth / 2, where the distance is `size` (see time_apart()). The test
// substitutes t into that equation at sizes from 1e-4 to 1e3 m; without speed and gravity, and with a speed
// apart, the time is infinite.
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

// Gravity along the separating plane brings the bodies no nearer, so that only the speed of 2 m/s counts: 0.9
// m / 2 m/s.
TEST(TimeApart, GravityCountsAcrossThePlaneBetweenThem) {
  const BodyBounds a = ball(Vec3::Zero(), 1, Vec3::Zero()), b = ball(Vec3(3, 0, 0), 1, Vec3(-2, 0, 0));
  EXPECT_NEAR(time_apart(a, b, 0.2, Vec3(0, -9.8, 0)), 0.9 / 2, 1e-12);
}

// Interlocked boxes have no separating plane. They may move by `depth` in any direction: 3 t + g t^2 = depth.
TEST(TimeApart, OfBodiesWithNoPlaneBetweenThemIsThatOfTheDepth) {
  BodyBounds a = ball(Vec3::Zero(), 0, Vec3(0, 3, 0)), b = ball(Vec3::Zero(), 0, Vec3::Zero());
  a.half = b.half = Vec3(1, 1, 1);
  const double g = 9.8, depth = 0.3, t = time_apart(a, b, depth, Vec3(0, -g, 0));
  EXPECT_NEAR(3 * t + g * t * t, depth, 1e-12);
}

}  // namespace
}  // namespace duet::body_bounds_test
