#include "sim/geometry/level_set/grid_level_set.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/level_set/solid.h"

namespace duet::grid_level_set_test {
namespace {

// Returns a random point of the box from `lower` to `upper`.
Vec3 point_within(std::mt19937& random, const Vec3& lower, const Vec3& upper) {
  return (lower + upper) / 2 + (upper - lower).cwiseProduct(test::random_vector(random)) / 2;
}

// Returns the exact signed distance of an L-shaped body, which is the union of two boxes. `tree` holds its
// surface.
double distance_to_l(const TriangleTree& tree, const Vec3& x) {
  const bool in_depth = x.z() > 0 && x.z() < 1;
  const bool lower = x.x() > 0 && x.x() < 2 && x.y() > 0 && x.y() < 1;
  const bool upper = x.x() > 0 && x.x() < 1 && x.y() > 0 && x.y() < 2;
  const double distance = tree.nearest(x).distance;
  return in_depth && (lower || upper) ? -distance : distance;
}

class GridOfL : public testing::Test {
 protected:
  static constexpr int cells = 40;
  TriangleMesh mesh = test::l_mesh();
  TriangleTree tree{mesh};
  GridLevelSet grid{mesh, cells};
  double h = 2.0 / cells;
  std::mt19937 random{19};
};

// The values at the nodes are exact distances rounded to floats. A wrong sign behind the concave edge of the
// L is found.
TEST_F(GridOfL, NodesHoldExactDistances) {
  const DenseGrid& nodes = grid.grid();
  EXPECT_DOUBLE_EQ(nodes.spacing, h);
  for (int k = 0; k < nodes.count.z(); k += 3)
    for (int j = 0; j < nodes.count.y(); j += 3)
      for (int i = 0; i < nodes.count.x(); i += 3) {
        const Vec3 x = nodes.origin + h * Vec3(i, j, k);
        const double expected = distance_to_l(tree, x);
        if (std::abs(expected) < 1e-9) continue;  // A point on the surface may have either sign.
        // Values are stored as floats.
        EXPECT_NEAR(static_cast<double>(nodes.values[nodes.index(i, j, k)]), expected, 1e-6);
      }
}

// Between nodes, the grid reproduces a distance that is linear there. At a kink of the distance, trilinear
// interpolation is off by up to half a cell, and by 5 % of one in the root mean square.
TEST_F(GridOfL, InterpolatesBetweenNodes) {
  double squares = 0;
  constexpr int n = 3000;
  for (int i = 0; i < n; ++i) {
    const Vec3 x =
        point_within(random, grid.lower() - Vec3::Constant(4 * h), grid.upper() + Vec3::Constant(4 * h));
    const double error = grid.distance(x) - distance_to_l(tree, x);
    EXPECT_LT(std::abs(error), 0.5 * h);
    squares += error * error;
  }
  EXPECT_LT(std::sqrt(squares / n), 0.05 * h);
}

// The normal is the gradient of the interpolated distance by central differences, normalized.
TEST_F(GridOfL, NormalsAreTheGradientOfTheDistance) {
  for (int i = 0; i < 500; ++i) {
    const Vec3 x = point_within(random, grid.lower(), grid.upper());
    const double step = 1e-5 * h;  // m: so small that the difference rarely crosses the border of two cells
    Vec3 gradient;
    for (int axis = 0; axis < 3; ++axis)
      gradient[axis] =
          (grid.distance(x + step * Vec3::Unit(axis)) - grid.distance(x - step * Vec3::Unit(axis))) /
          (2 * step);
    EXPECT_NEAR(grid.normal(x).norm(), 1, 1e-12);
    if (gradient.norm() > 0.1) {
      EXPECT_LT((gradient.normalized() - grid.normal(x)).norm(), 1e-4);
    }
  }
}

// Beyond the nodes of the grid, the distance and the normal come from the nearest point of the mesh.
TEST_F(GridOfL, IsExactBeyondItsNodes) {
  for (int i = 0; i < 500; ++i) {
    const Vec3 x = point_within(random, Vec3::Constant(-9), Vec3::Constant(9));
    if ((x.array() > -0.5).all() && (x.array() < 2.5).all()) continue;
    const TriangleTree::Nearest nearest = tree.nearest(x);
    EXPECT_EQ(grid.distance(x), nearest.distance);
    EXPECT_LT((grid.normal(x) - (x - nearest.point).normalized()).norm(), 1e-12);
  }
}

TEST_F(GridOfL, IsContinuousWhereItsNodesEnd) {
  const DenseGrid& nodes = grid.grid();
  const Vec3 last = nodes.origin + h * (nodes.count - Vec3i::Ones()).cast<double>();
  for (int i = 0; i < 200; ++i) {
    Vec3 x = point_within(random, nodes.origin, last);
    x.y() = last.y();
    const double inside = grid.distance(x - Vec3(0, 1e-9, 0)), outside = grid.distance(x + Vec3(0, 1e-9, 0));
    // The bound is the curvature of the distance over a cell, 5 cells away from the surface.
    EXPECT_NEAR(inside, outside, 0.05 * h);
  }
}

TEST_F(GridOfL, KnowsItsSizes) {
  EXPECT_EQ(grid.lower(), Vec3(0, 0, 0));
  EXPECT_EQ(grid.upper(), Vec3(2, 2, 1));
  EXPECT_DOUBLE_EQ(grid.bounding_radius(), std::sqrt(6));
  EXPECT_NEAR(grid.thickness(), 1, 2 * h);  // The legs are 1 m wide and 1 m deep.
}

// A comparison with NaN is false, so that a careless range check would read outside of the grid. The
// sanitizers watch.
TEST_F(GridOfL, WhatIsNotANumberIsNotInTheGrid) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Vec3& x : {Vec3(nan, 0, 0), Vec3(0, nan, 0), Vec3(1, 1, nan)})
    EXPECT_FALSE(grid.distance(x) < 1e300);
}

TEST(GridLevelSet, AgreesWithTheFormulaOfATorus) {
  const LevelSet torus = LevelSet::torus(1, 0.3);
  const GridLevelSet grid(test::torus_mesh(1, 0.3, 128, 64), 64);
  std::mt19937 random(23);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 x = point_within(random, Vec3(-1.5, -0.5, -1.5), Vec3(1.5, 0.5, 1.5));
    const double to_line = torus.distance(x) + 0.3;
    if (to_line < 0.1) continue;  // The distance has a kink at the middle line of the tube.
    EXPECT_NEAR(grid.distance(x), torus.distance(x), 0.1 * grid.grid().spacing);
    if (to_line < 0.6) {  // Beyond this distance the kink on the axis of the torus is near.
      EXPECT_GT(grid.normal(x).dot(torus.normal(x)), 0.99);
    }
  }
}

TEST(Solid, AMeshBodyLiesInItsFrame) {
  const TriangleMesh mesh = test::l_mesh();
  const Solid solid = make_solid(mesh, 0.5, 32);
  EXPECT_NEAR(solid.volume, 3.0 / 8, 1e-14);
  EXPECT_LT((solid.frame.position - Vec3(5, 5, 3) / 12).norm(), 1e-14);
  // The surface, the samples and the level set describe one body.
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    EXPECT_LT(
        (solid.frame.to_world(solid.surface.positions[i].cast<double>()) - 0.5 * mesh.positions[i]).norm(),
        1e-6);
  for (const Vec3& x : solid.samples)
    EXPECT_LT(std::abs(solid.level_set.distance(x)), 0.5 * solid.level_set.grid->grid().spacing);
  EXPECT_LT(solid.level_set.distance(solid.frame.to_body(Vec3(0.25, 0.25, 0.25))), -0.2);
  EXPECT_GT(solid.level_set.distance(solid.frame.to_body(Vec3(0.75, 0.75, 0.25))), 0.2);
  EXPECT_DOUBLE_EQ(solid.level_set.bounding_radius(), solid.level_set.grid->bounding_radius());
}

// Returns a disc of the radius 1 m about the y axis from y = 0 to `thickness` (m), whose faces are fans of
// needles, as programs make of polygons with many corners.
TriangleMesh disc_of_needles(int corners, double thickness) {
  TriangleMesh mesh;
  for (const double y : {0.0, thickness})
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * std::numbers::pi * i / corners;
      mesh.positions.emplace_back(std::cos(angle), y, std::sin(angle));
    }
  for (int i = 0; i < corners; ++i) {
    const int next = (i + 1) % corners;
    mesh.triangles.push_back({next, i, corners + i});
    mesh.triangles.push_back({next, corners + i, corners + next});
    if (i == 0 || next == 0) continue;
    mesh.triangles.push_back({0, i, next});
    mesh.triangles.push_back({corners, corners + next, corners + i});
  }
  return mesh;
}

// Fans of needles took as many searches as their edges squared: 14 s for a cylinder of 512 corners, and many
// minutes for this one, which the time limit of all tests would end.
TEST(GridLevelSet, IsMadeOfManyNeedles) {
  const GridLevelSet thick(disc_of_needles(3000, 1), 64);
  EXPECT_NEAR(thick.distance(Vec3(0.2, 0.3, 0.1)), -0.3, 1e-6);
}

// The places on needles lie as close as those on other triangles: no part of a thin wall is missed.
TEST(GridLevelSet, FindsThinWallsOfNeedles) {
  constexpr double thickness = 0.02;  // m: 0.64 cells
  const GridLevelSet disc(disc_of_needles(300, thickness), 64);
  EXPECT_NEAR(disc.thickness(), thickness, 1e-3);
  std::mt19937 random(11);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 x = point_within(random, Vec3(-1, 0, -1), Vec3(1, thickness, 1));
    if (Vec2(x.x(), x.z()).norm() > 0.97) continue;
    EXPECT_TRUE(disc.is_exact(x)) << x.transpose();
    EXPECT_NEAR(disc.distance(x), -std::min(x.y(), thickness - x.y()), 1e-9);
  }
}

}  // namespace
}  // namespace duet::grid_level_set_test
