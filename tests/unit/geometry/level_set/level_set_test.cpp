#include "sim/geometry/level_set/level_set.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

#include "sim/geometry/level_set/shape_mesh.h"
#include "sim/geometry/level_set/shape_samples.h"

namespace duet::level_set_test {
namespace {

constexpr double pi = std::numbers::pi;

std::vector<LevelSet> finite_shapes() {
  return {LevelSet::box(Vec3(2, 3, 1.4)), LevelSet::sphere(1.3), LevelSet::capsule(0.6, 1.7),
          LevelSet::cylinder(0.9, 1.5), LevelSet::torus(1.2, 0.5)};
}

TEST(LevelSet, BoxDistancesKnownByHand) {
  const LevelSet box = LevelSet::box(Vec3(2, 4, 6));
  EXPECT_DOUBLE_EQ(box.distance(Vec3(0, 0, 0)), -1);
  EXPECT_DOUBLE_EQ(box.distance(Vec3(0.75, 1.5, 0)), -0.25);
  EXPECT_DOUBLE_EQ(box.distance(Vec3(0, 3, 0)), 1);
  EXPECT_DOUBLE_EQ(box.distance(Vec3(1 + 3, 2 + 4, 0)), 5);      // An edge is nearest.
  EXPECT_DOUBLE_EQ(box.distance(Vec3(1 + 2, 2 + 3, 3 + 6)), 7);  // A corner is nearest.
  EXPECT_TRUE(box.normal(Vec3(0.1, -1.9, 0)).isApprox(Vec3(0, -1, 0)));
  EXPECT_TRUE(box.normal(Vec3(-4, 6, 0)).isApprox(Vec3(-0.6, 0.8, 0)));
}

TEST(LevelSet, SphereAndHalfSpaceDistancesKnownByHand) {
  const LevelSet sphere = LevelSet::sphere(2);
  EXPECT_DOUBLE_EQ(sphere.distance(Vec3(0, 3, 4)), 3);
  EXPECT_TRUE(sphere.normal(Vec3(0, 3, 4)).isApprox(Vec3(0, 0.6, 0.8)));
  // Any direction is right at the center, but it must be one.
  EXPECT_NEAR(sphere.normal(Vec3::Zero()).norm(), 1, 1e-15);
  EXPECT_DOUBLE_EQ(LevelSet::half_space().distance(Vec3(5, -2, 1)), -2);
}

TEST(LevelSet, CapsuleDistancesKnownByHand) {
  const LevelSet capsule = LevelSet::capsule(1, 4);  // The middle line runs from y = -2 to 2.
  EXPECT_DOUBLE_EQ(capsule.distance(Vec3(3, 1, 4)), 4);
  EXPECT_DOUBLE_EQ(capsule.distance(Vec3(3, -6, 0)), 4);  // The lower end is nearest.
  EXPECT_DOUBLE_EQ(capsule.distance(Vec3(0, 1.5, 0)), -1);
  EXPECT_DOUBLE_EQ(capsule.distance(Vec3(0, 2.5, 0)), -0.5);
  EXPECT_TRUE(capsule.normal(Vec3(3, -6, 0)).isApprox(Vec3(0.6, -0.8, 0)));
}

TEST(LevelSet, CylinderDistancesKnownByHand) {
  const LevelSet cylinder = LevelSet::cylinder(2, 2);
  EXPECT_DOUBLE_EQ(cylinder.distance(Vec3(3, 0.5, 4)), 3);  // The side is nearest.
  EXPECT_DOUBLE_EQ(cylinder.distance(Vec3(1, -4, 1)), 3);   // The lower cap is nearest.
  EXPECT_DOUBLE_EQ(cylinder.distance(Vec3(5, 5, 0)), 5);    // The rim is nearest.
  EXPECT_DOUBLE_EQ(cylinder.distance(Vec3(1.5, 0, 0)), -0.5);
  EXPECT_DOUBLE_EQ(cylinder.distance(Vec3(0, 0.75, 0)), -0.25);
  EXPECT_TRUE(cylinder.normal(Vec3(5, -5, 0)).isApprox(Vec3(0.6, -0.8, 0)));
  EXPECT_TRUE(cylinder.normal(Vec3(0, -0.5, -1.9)).isApprox(Vec3(0, 0, -1)));
}

TEST(LevelSet, TorusDistancesKnownByHand) {
  const LevelSet torus = LevelSet::torus(3, 1);
  EXPECT_DOUBLE_EQ(torus.distance(Vec3::Zero()), 2);
  EXPECT_DOUBLE_EQ(torus.distance(Vec3(0, 4, 0)), 4);  // The point is 5 from the middle line of the ring.
  EXPECT_DOUBLE_EQ(torus.distance(Vec3(3, 0, 4)), 1);
  EXPECT_DOUBLE_EQ(torus.distance(Vec3(0, 0.5, -3)), -0.5);
  EXPECT_TRUE(torus.normal(Vec3(0, 0, 2)).isApprox(Vec3(0, 0, -1)));
  EXPECT_TRUE(torus.normal(Vec3(0, 0.5, -3)).isApprox(Vec3(0, 1, 0)));
}

// The normal equals the gradient of the distance by central differences, wherever the distance is smooth.
TEST(LevelSet, NormalIsTheGradient) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-3, 3);
  std::vector<LevelSet> shapes = finite_shapes();
  shapes.push_back(LevelSet::half_space());
  for (const LevelSet& shape : shapes) {
    int smooth = 0;
    for (int i = 0; i < 300; ++i) {
      const Vec3 x(uniform(random), uniform(random), uniform(random));
      constexpr double h = 1e-6;
      Vec3 gradient;
      for (int k = 0; k < 3; ++k)
        gradient[k] =
            (shape.distance(x + h * Vec3::Unit(k)) - shape.distance(x - h * Vec3::Unit(k))) / (2 * h);
      // The point is on the medial surface, where the gradient is not defined.
      if (std::abs(gradient.norm() - 1) > 1e-6) continue;
      ++smooth;
      EXPECT_LT((gradient - shape.normal(x)).norm(), 1e-6);
    }
    EXPECT_GT(smooth, 280);
  }
}

TEST(LevelSet, NormalsAreUnitWhereTheNearestPointIsNotUnique) {
  std::vector<LevelSet> shapes = finite_shapes();
  for (const LevelSet& shape : shapes)
    for (const Vec3& x : {Vec3(0, 0, 0), Vec3(0, 0.4, 0), Vec3(0, -5, 0), Vec3(0, -0.75, 0), Vec3(1.2, 0, 0),
                          Vec3(0, 0, -1.2), Vec3(0.9, 0.75, 0), Vec3(-1, 1.5, 0.7)}) {
      EXPECT_NEAR(shape.normal(x).norm(), 1, 1e-14);
      // The normal leads to one of the nearest points of the surface.
      EXPECT_NEAR(shape.distance(x - shape.distance(x) * shape.normal(x)), 0, 1e-14);
    }
}

// Returns points all over the surface, such that no point of it is farther than `spacing` (m) from one of
// them. Round shapes are surfaces of revolution of their outlines in the xy plane.
std::vector<Vec3> dense_points(const LevelSet& shape, double spacing) {
  if (shape.kind == LevelSet::Kind::box) return surface_samples(shape, spacing);
  std::vector<Vec2> outline;
  const auto add_line = [&](const Vec2& a, const Vec2& b) {
    const int n = static_cast<int>(std::ceil((b - a).norm() / spacing)) + 1;
    for (int i = 0; i <= n; ++i) outline.push_back(a + (b - a) * i / n);
  };
  const auto add_arc = [&](const Vec2& center, double radius, double from, double to) {
    const int n = static_cast<int>(std::ceil(radius * (to - from) / spacing)) + 1;
    for (int i = 0; i <= n; ++i) {
      const double angle = from + (to - from) * i / n;
      outline.push_back(center + radius * Vec2(std::cos(angle), std::sin(angle)));
    }
  };
  const double r = shape.radius, h = shape.half_length, right = std::numbers::pi / 2;
  if (shape.kind == LevelSet::Kind::cylinder) {
    for (const double end : {-h, h}) add_line(Vec2(0, end), Vec2(r, end));
    add_line(Vec2(r, -h), Vec2(r, h));
  } else if (shape.kind == LevelSet::Kind::torus) {
    add_arc(Vec2(r, 0), shape.tube, 0, 4 * right);
  } else {
    add_line(Vec2(r, -h), Vec2(r, h));
    add_arc(Vec2(0, h), r, 0, right);
    add_arc(Vec2(0, -h), r, -right, 0);
  }
  std::vector<Vec3> points;
  for (const Vec2& p : outline) {
    const int n = static_cast<int>(std::ceil(4 * right * p.x() / spacing)) + 1;
    for (int i = 0; i < n; ++i) {
      const double angle = 4 * right * i / n;
      points.emplace_back(p.x() * std::cos(angle), p.y(), p.x() * std::sin(angle));
    }
  }
  return points;
}

// The distance of a point is at most the distance of the nearest surface point and at least that less the
// spacing of these points, inside and outside.
TEST(LevelSet, DistancesAreExactOnBothSides) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-2.2, 2.2);
  constexpr double spacing = 0.05;
  for (const LevelSet& shape : finite_shapes()) {
    const std::vector<Vec3> samples = dense_points(shape, spacing);
    for (int i = 0; i < 100; ++i) {
      const Vec3 x(uniform(random), uniform(random), uniform(random));
      double nearest = 10;
      for (const Vec3& sample : samples) nearest = std::min(nearest, (x - sample).norm());
      const double distance = std::abs(shape.distance(x));
      EXPECT_LE(distance, nearest + 1e-12);
      EXPECT_GE(distance, nearest - spacing);
    }
  }
}

TEST(LevelSet, BoundsAndSizesAreThoseOfTheSurface) {
  for (const LevelSet& shape : finite_shapes()) {
    const TriangleMesh mesh = test::mesh_of(shape_surface(shape));
    Eigen::AlignedBox3d box;
    double radius = 0;
    for (const Vec3& x : mesh.positions) {
      box.extend(x);
      radius = std::max(radius, x.norm());
    }
    EXPECT_LT((box.min() - shape.lower()).norm(), 1e-6);
    EXPECT_LT((box.max() - shape.upper()).norm(), 1e-6);
    EXPECT_NEAR(radius, shape.bounding_radius(), 1e-6);
  }
  EXPECT_DOUBLE_EQ(LevelSet::capsule(1, 4).min_size(), 2);
  EXPECT_DOUBLE_EQ(LevelSet::cylinder(2, 3).min_size(), 3);
  EXPECT_DOUBLE_EQ(LevelSet::cylinder(1, 3).min_size(), 2);
  EXPECT_DOUBLE_EQ(LevelSet::torus(3, 0.5).min_size(), 1);
}

TEST(LevelSet, MassPropertiesKnownByHand) {
  EXPECT_NEAR(volume(LevelSet::sphere(2)), 33.510321638291124, 1e-12);
  EXPECT_DOUBLE_EQ(volume(LevelSet::box(Vec3(2, 3, 4))), 24);
  EXPECT_TRUE(unit_inertia(LevelSet::sphere(2)).isApprox(Vec3::Constant(1.6)));
  // Per unit mass the moments are (b^2 + c^2) / 12.
  EXPECT_TRUE(unit_inertia(LevelSet::box(Vec3(2, 3, 4))).isApprox(Vec3(25, 20, 13) / 12));
  EXPECT_DOUBLE_EQ(volume(LevelSet::cylinder(2, 3)), 12 * pi);
  EXPECT_TRUE(unit_inertia(LevelSet::cylinder(2, 3)).isApprox(Vec3(1.75, 2, 1.75)));
  EXPECT_DOUBLE_EQ(volume(LevelSet::torus(3, 1)), 6 * pi * pi);
  EXPECT_TRUE(unit_inertia(LevelSet::torus(3, 1)).isApprox(Vec3(5.125, 9.75, 5.125)));
  EXPECT_DOUBLE_EQ(volume(LevelSet::capsule(1, 3)), 3 * pi + 4 * pi / 3);
  // A capsule without length is a sphere.
  EXPECT_TRUE(unit_inertia(LevelSet::capsule(1, 1e-9)).isApprox(Vec3::Constant(0.4), 1e-8));
}

// The render surfaces have their vertices on the shape, so the formulas agree with integrals over the facets
// up to what the facets cut off: (pi / n)^2 / 3 = 0.33 % of a length for the n = 32 rows of the torus.
TEST(LevelSet, FormulasAgreeWithIntegralsOverFacets) {
  for (const LevelSet& shape : finite_shapes()) {
    const MassProperties facets = mass_properties(test::mesh_of(shape_surface(shape)));
    EXPECT_NEAR(facets.volume / volume(shape), 1, 0.01);
    EXPECT_LT((facets.unit_inertia - unit_inertia(shape)).norm(), 0.01 * unit_inertia(shape).norm());
    EXPECT_LT(facets.frame.position.norm(), 1e-6);
  }
}

#ifdef DUET_ASSERTS
// The formulas of a torus hold for tubes that leave its hole open.
TEST(LevelSet, RefusesTubesThatCloseTheirTorus) {
  EXPECT_DEATH(LevelSet::torus(1, 1.5), "tube < radius does not hold");
}
#endif

}  // namespace
}  // namespace duet::level_set_test
