#include "sim/geometry/queries/continuous_collision.h"

#include <functional>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

namespace duet::continuous_collision_test {
namespace {

using test::random_vector;

// Linear motion of the four corners of a pair of elements, for t from 0 to 1.
struct Path {
  FourPoints start, end;
  FourPoints at(double t) const {
    FourPoints x;
    for (std::size_t i = 0; i < 4; ++i) x[i] = start[i] + t * (end[i] - start[i]);
    return x;
  }
  double distance(ElementPair kind, double t) const { return closest_points(kind, at(t)).difference.norm(); }
};

FourPoints random_corners(std::mt19937& random, double scale) {
  FourPoints x;
  for (Vec3& corner : x) corner = scale * random_vector(random);
  return x;
}

// Families of motions. Most hide crossings from tests that seek roots of the volume that the four corners
// span.
const std::vector<std::function<Path(std::mt19937&)>> families = {
    [](std::mt19937& r) {
      return Path{random_corners(r, 1), random_corners(r, 1)};
    },
    [](std::mt19937& r) {  // small moves
      Path path{random_corners(r, 1), {}};
      for (std::size_t i = 0; i < 4; ++i) path.end[i] = path.start[i] + 0.1 * random_vector(r);
      return path;
    },
    [](std::mt19937& r) {  // All corners stay in one plane.
      Path path{random_corners(r, 1), random_corners(r, 1)};
      for (std::size_t i = 0; i < 4; ++i) path.start[i].z() = path.end[i].z() = 0.3;
      return path;
    },
    [](std::mt19937& r) {  // Edges stay parallel, and triangles stay on a line.
      Path path{random_corners(r, 1), {}};
      const Vec3 direction = random_vector(r), first = random_vector(r), second = random_vector(r);
      path.start[1] = path.start[0] + direction;
      path.start[3] = path.start[2] - 0.7 * direction;
      for (std::size_t i = 0; i < 4; ++i) path.end[i] = path.start[i] + (i < 2 ? first : second);
      return path;
    },
    [](std::mt19937& r) {  // One element has no extent.
      Path path{random_corners(r, 1), random_corners(r, 1)};
      path.start[3] = path.start[2];
      path.end[3] = path.end[2];
      return path;
    },
    [](std::mt19937& r) {  // nothing moves
      const FourPoints x = random_corners(r, 1);
      return Path{x, x};
    },
    [](std::mt19937& r) {  // The elements pass each other very fast.
      return Path{random_corners(r, 1), random_corners(r, 1000)};
    },
    [](std::mt19937& r) {  // The elements are tiny and far from the origin.
      Path path{random_corners(r, 1e-5), random_corners(r, 1e-5)};
      const Vec3 place(1e3, -2e3, 5e2);
      for (std::size_t i = 0; i < 4; ++i) {
        path.start[i] += place;
        path.end[i] += place;
      }
      return path;
    },
    [](std::mt19937& r) {
      return Path{random_corners(r, 1e6), random_corners(r, 1e6)};
    },
};

constexpr ElementPair kinds[] = {ElementPair::point_triangle, ElementPair::edge_edge};

// Until the impact time, the elements are at least the gap apart, by densely sampled distances. At the impact
// they are about the gap apart, so that the time is not much too early.
TEST(ContinuousCollision, KeepsTheGapUntilTheImpactInAllFamilies) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const auto& family : families)
    for (int i = 0; i < 600; ++i)
      for (const ElementPair kind : kinds) {
        const Path path = family(random);
        const double start = path.distance(kind, 0);
        if (start < 1e-15 * path.start[0].norm())
          continue;  // Crossed edges of one plane touch from the start.
        const double gap = start * std::pow(10.0, -5 * uniform(random)) / 2;
        const auto impact = first_impact(kind, path.start, path.end, gap);
        // Distances far from the origin are measured here with that much rounding.
        const double rounding = 1e-15 * path.start[0].norm();
        for (int k = 0; k <= 200; ++k) {
          const double t = k / 200.0;
          if (impact && t > impact->time) break;
          ASSERT_GE(path.distance(kind, t), gap - rounding);
        }
        if (!impact) continue;
        // The impact is not reported sooner than necessary: the search ends within 1.25 gaps, plus rounding.
        EXPECT_LE(path.distance(kind, impact->time), 1.26 * gap + 1e-12 * path.at(1)[0].norm());
        EXPECT_NEAR(impact->normal.norm(), 1, 1e-12);
      }
}

// A corner of one element is led exactly through the other element at a random time. An impact must be found
// at that time or before.
TEST(ContinuousCollision, NoCrossingIsMissed) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const auto& family : families)
    for (int i = 0; i < 3000; ++i)
      for (const ElementPair kind : kinds) {
        Path path = family(random);
        const double t = 0.05 + 0.95 * uniform(random);
        // Barycentric coordinates of the meeting point, on edges and corners in every fourth motion each.
        double u = uniform(random), v = uniform(random) * (1 - u);
        if (i % 4 == 1) v = 0;
        if (i % 4 == 2) u = v = 0;
        const FourPoints x = path.at(t);
        if (kind == ElementPair::point_triangle) {
          const Vec3 target = (1 - u - v) * x[1] + u * x[2] + v * x[3];
          path.end[0] = path.start[0] + (target - path.start[0]) / t;
        } else {  // The first edge moves as a whole.
          const Vec3 shift = (1 - v) * x[2] + v * x[3] - (1 - u) * x[0] - u * x[1];
          for (std::size_t k = 0; k < 2; ++k) path.end[k] += shift / t;
        }
        const double start = path.distance(kind, 0);
        if (!(start > 0)) continue;
        const auto impact = first_impact(kind, path.start, path.end, 1e-3 * start);
        ASSERT_TRUE(impact);
        EXPECT_LE(impact->time, t);
      }
}

TEST(ContinuousCollision, TouchingElementsHaveTheImpactTimeZero) {
  const FourPoints touching = {Vec3(0.2, 0.3, 0), Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
  FourPoints away = touching;
  away[0].z() = 1;
  const auto impact = first_impact(ElementPair::point_triangle, touching, away, 1e-9);
  ASSERT_TRUE(impact);
  EXPECT_EQ(impact->time, 0);
  EXPECT_EQ(impact->normal, Vec3::Zero());
}

TEST(ContinuousCollision, MatchesKnownTimesAndNormals) {
  const FourPoints above = {Vec3(0.2, 0.3, 1), Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
  FourPoints below = above;
  below[0].z() = -1;
  const double gap = 0.01;  // The function widens the gap by its bound on rounding, which is 2e-14 here.
  const auto fall = first_impact(ElementPair::point_triangle, above, below, gap);
  ASSERT_TRUE(fall);
  EXPECT_NEAR(fall->time, (1 - gap) / 2, 2e-14);
  EXPECT_NEAR((fall->normal - Vec3::UnitZ()).norm(), 0, 1e-14);
  EXPECT_NEAR(fall->at.weight[1], -0.5, 1e-14);

  const FourPoints crossed = {Vec3(-1, 0, 1), Vec3(1, 0, 1), Vec3(0, -1, 0), Vec3(0, 1, 0)};
  FourPoints passed = crossed;
  passed[0].z() = passed[1].z() = -3;
  const auto cross = first_impact(ElementPair::edge_edge, crossed, passed, gap);
  ASSERT_TRUE(cross);
  EXPECT_NEAR(cross->time, (1 - gap) / 4, 2e-14);
  EXPECT_NEAR((cross->normal - Vec3::UnitZ()).norm(), 0, 1e-14);

  FourPoints grazing = above;  // The point passes the corner of the triangle at twice the gap.
  grazing[0] = Vec3(-1, -2 * gap, 0);
  FourPoints gone = grazing;
  gone[0].x() = 2;
  EXPECT_FALSE(first_impact(ElementPair::point_triangle, grazing, gone, gap));
  EXPECT_TRUE(first_impact(ElementPair::point_triangle, grazing, gone, 2.1 * gap));
}

// Sliding at a distance greater than the gap, as cloth on cloth, is no impact, however far the slide goes.
TEST(ContinuousCollision, SlidingIsNoImpact) {
  const FourPoints start = {Vec3(0.2, 0.3, 1e-6), Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
  FourPoints end = start;
  end[0] += Vec3(1e3, -2e3, 0);
  EXPECT_FALSE(first_impact(ElementPair::point_triangle, start, end, 0.5e-6));
}

}  // namespace
}  // namespace duet::continuous_collision_test
