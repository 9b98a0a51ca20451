#include "sim/geometry/level_set.h"

#include <map>
#include <random>

#include <gtest/gtest.h>

#include "sim/geometry/shape_mesh.h"

namespace duet {
namespace {

TEST(LevelSet, BoxDistancesKnownByHand) {
  const LevelSet box = LevelSet::box(Vec3(2, 4, 6));
  EXPECT_DOUBLE_EQ(box.distance(Vec3(0, 0, 0)), -1);
  EXPECT_DOUBLE_EQ(box.distance(Vec3(0.75, 1.5, 0)), -0.25);
  EXPECT_DOUBLE_EQ(box.distance(Vec3(0, 3, 0)), 1);
  EXPECT_DOUBLE_EQ(box.distance(Vec3(1 + 3, 2 + 4, 0)), 5);      // nearest is an edge
  EXPECT_DOUBLE_EQ(box.distance(Vec3(1 + 2, 2 + 3, 3 + 6)), 7);  // nearest is a corner
  EXPECT_TRUE(box.normal(Vec3(0.1, -1.9, 0)).isApprox(Vec3(0, -1, 0)));
  EXPECT_TRUE(box.normal(Vec3(-4, 6, 0)).isApprox(Vec3(-0.6, 0.8, 0)));
}

TEST(LevelSet, SphereAndHalfSpace) {
  const LevelSet sphere = LevelSet::sphere(2);
  EXPECT_DOUBLE_EQ(sphere.distance(Vec3(0, 3, 4)), 3);
  EXPECT_TRUE(sphere.normal(Vec3(0, 3, 4)).isApprox(Vec3(0, 0.6, 0.8)));
  EXPECT_NEAR(sphere.normal(Vec3::Zero()).norm(), 1, 1e-15);  // any direction, but one
  EXPECT_DOUBLE_EQ(LevelSet::half_space().distance(Vec3(5, -2, 1)), -2);
}

// The gradient by central differences is the normal, wherever the distance is smooth.
TEST(LevelSet, NormalIsTheGradient) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-3, 3);
  for (const LevelSet& shape :
       {LevelSet::box(Vec3(2, 3, 1.4)), LevelSet::sphere(1.3), LevelSet::half_space()}) {
    int smooth = 0;
    for (int i = 0; i < 300; ++i) {
      const Vec3 x(uniform(random), uniform(random), uniform(random));
      constexpr double h = 1e-6;
      Vec3 gradient;
      for (int k = 0; k < 3; ++k)
        gradient[k] =
            (shape.distance(x + h * Vec3::Unit(k)) - shape.distance(x - h * Vec3::Unit(k))) / (2 * h);
      if (std::abs(gradient.norm() - 1) > 1e-6) continue;  // on a medial plane of the box
      ++smooth;
      EXPECT_LT((gradient - shape.normal(x)).norm(), 1e-6);
    }
    EXPECT_GT(smooth, 280);
  }
}

TEST(LevelSet, MassPropertiesByClosedFormulas) {
  EXPECT_NEAR(volume(LevelSet::sphere(2)), 33.510321638291124, 1e-12);
  EXPECT_DOUBLE_EQ(volume(LevelSet::box(Vec3(2, 3, 4))), 24);
  EXPECT_TRUE(unit_inertia(LevelSet::sphere(2)).isApprox(Vec3::Constant(1.6)));
  EXPECT_TRUE(
      unit_inertia(LevelSet::box(Vec3(2, 3, 4))).isApprox(Vec3(25, 20, 13) / 12));  // (b^2 + c^2) / 12
}

TEST(ShapeMesh, SamplesLieOnTheSurfaceAndCoverCornersEdgesAndFaces) {
  const LevelSet box = LevelSet::box(Vec3(2, 4, 6));
  const std::vector<Vec3> samples = surface_samples(box, 8);
  EXPECT_EQ(samples.size(), 9u * 9 * 9 - 7 * 7 * 7);
  for (const Vec3& x : samples) EXPECT_NEAR(box.distance(x), 0, 1e-15);
}

// Every edge of a closed, consistently oriented surface is run through once each way.
void expect_closed(const Surface& surface, double volume_expected, double tolerance) {
  std::map<std::pair<int, int>, int> edges;
  double six_volumes = 0;
  for (const auto& t : surface.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k].position, t[(k + 1) % 3].position}];
    const auto at = [&](std::size_t k) {
      return surface.positions[static_cast<std::size_t>(t[k].position)].cast<double>().eval();
    };
    six_volumes += at(0).dot(at(1).cross(at(2)));
    const Vec3 normal = (at(1) - at(0)).cross(at(2) - at(0)).normalized();
    for (const Corner& c : t)
      EXPECT_GT(normal.dot(surface.normals[static_cast<std::size_t>(c.normal)].cast<double>()), 0.9);
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first}));
  }
  EXPECT_NEAR(six_volumes / 6, volume_expected, tolerance);
}

TEST(ShapeMesh, RenderSurfacesAreClosedAndOutward) {
  expect_closed(shape_surface(LevelSet::box(Vec3(2, 3, 4))), 24, 1e-5);
  expect_closed(shape_surface(LevelSet::sphere(1)), 4.18879, 0.03);  // its facets cut 0.7 % off
}

}  // namespace
}  // namespace duet
