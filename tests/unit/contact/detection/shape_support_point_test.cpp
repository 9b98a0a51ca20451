#include "sim/contact/detection/shape_support_point.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

#include "sim/contact/detection/contact_point.h"

namespace duet::shape_support_point_test {
namespace {

using test::random_rotation;
using test::random_vector;
constexpr double pi = std::numbers::pi;

// Returns the point of a shape that is lowest in the direction `down` (unit): of a ball, of an end of a
// capsule or a rim of a cylinder (`side` is +1 or -1), or of a torus. Returns nothing if a whole circle is
// nearly as low, so that rounding chooses one of its points.
std::optional<Vec3> lowest_point(const LevelSet& shape, double side, const Pose& pose, const Vec3& down) {
  const Vec3 axis = pose.orientation * Vec3::UnitY();
  const Vec3 across = down - down.dot(axis) * axis;
  const Vec3 end = pose.position + side * shape.half_length * axis;
  const bool is_ball = shape.kind == LevelSet::Kind::sphere;
  if (is_ball || shape.kind == LevelSet::Kind::capsule)
    return (is_ball ? pose.position : end) + shape.radius * down;
  if (across.norm() < 0.05) return {};
  const bool is_rim = shape.kind == LevelSet::Kind::cylinder;
  return end + shape.radius * across.normalized() + (is_rim ? 0 : shape.tube) * down;
}

// Over a plane, the support points are the lowest points, at any position and orientation. The bounds are
// rounding of a dozen operations on numbers up to 5, and 1 / 0.05 times as much in the direction of a short
// projection.
TEST(ShapeSupportPoint, OverAPlaneIsTheLowestPointAtAnyOrientation) {
  std::mt19937 random(1);
  RigidProperties ground, guest;
  ground.shape = LevelSet::half_space();
  int told = 0;
  for (int i = 0; i < 400; ++i) {
    const Pose plane{2 * random_vector(random), random_rotation(random)},
        pose{2 * random_vector(random), random_rotation(random)};
    const Vec3 up = plane.orientation * Vec3::UnitY();
    for (const LevelSet& shape : {LevelSet::sphere(0.7), LevelSet::capsule(0.3, 1.1),
                                  LevelSet::cylinder(0.6, 0.5), LevelSet::torus(0.8, 0.3)}) {
      guest.shape = shape;
      for (int k = 0; k < support_point_count(shape); ++k) {
        const auto expected = lowest_point(shape, k == 0 ? 1 : -1, pose, -up);
        if (!expected) continue;
        ++told;
        const Touch lowest = touch(ground, plane, guest, pose, FeatureId::support(k));
        EXPECT_LT((lowest.position - *expected).norm(), 1e-13);
        EXPECT_LT((lowest.normal - up).norm(), 1e-15);
        EXPECT_NEAR(lowest.gap, up.dot(*expected - plane.position), 1e-14);
        const ShapeSupportPoint same = support_point(shape, k, pose.orientation.conjugate() * up);
        EXPECT_LT((pose.to_world(same.position) - *expected).norm(), 1e-13);
        EXPECT_LT(shape.distance(same.inside), -0.17 * shape.min_size());
      }
    }
  }
  EXPECT_GT(told, 2300);  // one in 800 directions is within the limit of lowest_point()
}

// If a whole circle is lowest, any point of it may be the support point, but it has to be on the circle.
TEST(ShapeSupportPoint, OfCirclesThatLieFlatIsAnyOfThem) {
  const LevelSet ground = LevelSet::half_space();
  const Pose pose{Vec3(3, 2, 1), Quat::Identity()};
  const ShapeSupportPoint ring = support_point(LevelSet::torus(0.75, 0.25), 0, pose, ground);
  EXPECT_EQ(ring.position.y(), 1.75);
  EXPECT_EQ((ring.inside - pose.position).norm(), 0.75);
  const LevelSet can = LevelSet::cylinder(0.5, 2);
  EXPECT_EQ(support_point(can, 0, pose, ground).position.y(), 3);
  EXPECT_EQ(support_point(can, 1, pose, ground).position.y(), 1);
}

// Inner points lie a radius deep under balls and tubes. Under rims they lie a quarter of the smallest size
// in, halfway between cap and side: 0.125 sqrt(1/2) deep here.
TEST(ShapeSupportPoint, InnerPointsLieSomeWayIn) {
  std::mt19937 random(2);
  const LevelSet can = LevelSet::cylinder(0.6, 0.5), ring = LevelSet::torus(0.8, 0.3),
                 pill = LevelSet::capsule(0.3, 1.1);
  for (int i = 0; i < 50; ++i) {
    const Pose pose{2 * random_vector(random), random_rotation(random)};
    const auto expect_depth = [&](const LevelSet& shape, int k, double depth) {
      const ShapeSupportPoint point = support_point(shape, k, pose, LevelSet::half_space());
      EXPECT_NEAR(shape.distance(pose.to_body(point.position)), 0, 1e-14);
      EXPECT_NEAR(shape.distance(pose.to_body(point.inside)), -depth, 1e-14);
    };
    expect_depth(ring, 0, 0.3);
    for (const int k : {0, 1}) expect_depth(can, k, 0.125 * std::sqrt(0.5));
    // The end ball that is higher has its lowest point inside of the capsule, and is left out.
    expect_depth(pill, (pose.orientation * Vec3::UnitY()).y() < 0 ? 0 : 1, 0.3);
  }
}

// Boxes and half spaces touch with samples and feature edges, and have no support points.
TEST(ShapeSupportPoint, ShapesWithEdgesHaveNone) {
  EXPECT_EQ(support_point_count(LevelSet::box(Vec3(1, 1, 1))), 0);
  EXPECT_EQ(support_point_count(LevelSet::half_space()), 0);
}

// Returns the smallest distance (m) of 10^4 points of the torus from the host.
double min_distance(const LevelSet& torus, const Pose& pose, const LevelSet& host) {
  double least = 1e9;
  for (int i = 0; i < 100; ++i)
    for (int j = 0; j < 100; ++j) {
      const double around = 2 * pi * i / 100, tube = 2 * pi * j / 100;
      const double rho = torus.radius + torus.tube * std::cos(tube);
      const Vec3 x(rho * std::sin(around), torus.tube * std::sin(tube), rho * std::cos(around));
      least = std::min(least, host.distance(pose.to_world(x)));
    }
  return least;
}

// No point of a torus is deeper in a box or a ball than its support point, but for rounding. Over a face the
// fixed-point steps are exact; on a ball the first one is, in the plane through the axis of the torus and the
// center of the ball. The support point lies on the torus, so it cannot be deeper than the deepest of all
// points either.
class TorusOn : public testing::TestWithParam<const char*> {};

TEST_P(TorusOn, NoPointIsDeeper) {
  const bool on_ball = std::string_view(GetParam()) != "box", around = std::string_view(GetParam()) == "pin";
  const LevelSet torus = LevelSet::torus(0.8, 0.3);
  const LevelSet host = on_ball ? LevelSet::sphere(around ? 0.4 : 1) : LevelSet::box(Vec3(8, 2, 8));
  std::mt19937 random(3);
  int tried = 0;
  while (tried < 60) {
    Pose pose{2 * random_vector(random), random_rotation(random)};
    if (!on_ball) pose.position.y() += 3.2;  // overlaps by 0.1 m at most, over the middle of the face
    if (on_ball) {
      const Vec3 axis = pose.orientation * Vec3::UnitY();
      const double off_axis = (pose.position - pose.position.dot(axis) * axis).norm();
      if (around != (off_axis < torus.radius) || off_axis < 0.05) continue;
    }
    ++tried;
    const ShapeSupportPoint deepest = support_point(torus, 0, pose, host);
    EXPECT_NEAR(torus.distance(pose.to_body(deepest.position)), 0, 1e-14);
    EXPECT_LE(host.distance(deepest.position), min_distance(torus, pose, host) + 1e-14) << tried;
  }
}

// In the case "pin" the center of the ball lies in the hole of the torus, as seen along its axis.
INSTANTIATE_TEST_SUITE_P(Hosts, TorusOn, testing::Values("box", "ball", "pin"),
                         [](const auto& host) { return host.param; });

// On a ball the first step is exact for rims too, from whose center it starts. The later steps take the
// normal below the rim, and around a small ball would lead to its far side: the best of all steps counts.
TEST(ShapeSupportPoint, OfARimOverABallIsItsNearestPoint) {
  const LevelSet can = LevelSet::cylinder(0.8, 0.6), ball = LevelSet::sphere(0.4);
  std::mt19937 random(5);
  for (int i = 0; i < 60; ++i) {
    const Pose pose{2 * random_vector(random), random_rotation(random)};
    for (const int k : {0, 1}) {
      double least = 1e9;
      for (int j = 0; j < 10000; ++j) {
        const double around = 2 * pi * j / 10000;
        const Vec3 x(can.radius * std::sin(around), k == 0 ? 0.3 : -0.3, can.radius * std::cos(around));
        least = std::min(least, ball.distance(pose.to_world(x)));
      }
      const ShapeSupportPoint deepest = support_point(can, k, pose, ball);
      EXPECT_LE(ball.distance(deepest.position), least + 1e-14);
      EXPECT_NEAR(can.distance(pose.to_body(deepest.position)), 0, 1e-14);
    }
  }
}

// On hosts that curve, or whose nearest point moves along an edge, every step brings the direction nearer by
// a factor. At the distance D a ring with the radius R sees normals that differ by R / D at most, or by up to
// twice that of their component in its plane if they are slanted: 0.22 here. After four steps the angle is
// off by 0.22^4 and the gap by R / 2 times its square, 6e-7 m, below the bound of 1e-6 m. The best of 10^4
// points of the ring is off by less than 1e-8 m.
TEST(ShapeSupportPoint, OnCurvedHostsTheStepsConverge) {
  const LevelSet ring = LevelSet::torus(0.2, 0.05);
  std::mt19937 random(4);
  for (const LevelSet& host : {LevelSet::capsule(0.3, 2), LevelSet::box(Vec3(1, 2, 1.5))}) {
    int tried = 0;
    while (tried < 50) {
      const Pose pose{5 * random_vector(random), random_rotation(random)};
      const Vec3 axis = pose.orientation * Vec3::UnitY();
      if (host.distance(pose.position) < 2 || std::abs(host.normal(pose.position).dot(axis)) > 0.85) continue;
      ++tried;
      double least = 1e9;
      for (int i = 0; i < 10000; ++i) {
        const double around = 2 * pi * i / 10000;
        const Vec3 x(ring.radius * std::sin(around), 0, ring.radius * std::cos(around));
        least = std::min(least, host.distance(pose.to_world(x)) - ring.tube);
      }
      const Vec3 deepest = support_point(ring, 0, pose, host).position;
      EXPECT_NEAR(host.distance(deepest), least, 1e-6);
    }
  }
}

}  // namespace
}  // namespace duet::shape_support_point_test
