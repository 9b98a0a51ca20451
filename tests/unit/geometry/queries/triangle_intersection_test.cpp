#include "sim/geometry/queries/triangle_intersection.h"

#include <algorithm>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

#include "sim/geometry/mesh/orientation.h"

namespace duet::triangle_intersection_test {
namespace {

using test::random_vector;

// The sign of the orientation is exact for points that are one unit in the last place off a plane. A
// determinant in plain doubles fails here.
TEST(Orientation, IsExactNextToAPlane) {
  // The points lie in a plane with normal (1, 2, -3), whose products are exact in integers.
  std::mt19937 random(5);
  std::uniform_int_distribution<int> integer(-1000000, 1000000);
  const auto on_plane = [&] {
    const double y = integer(random), z = integer(random);
    return Vec3(3 * z - 2 * y, y, z);
  };
  for (int i = 0; i < 2000; ++i) {
    Vec3 a = on_plane(), b = on_plane(), c = on_plane(), d = on_plane();
    EXPECT_EQ(orientation(a, b, c, d), 0);
    Vec3 above = d;
    // The point moves to the side to which the plane's normal points.
    above.x() = std::nextafter(d.x(), 1e9);
    const double turn = (b - a).cross(c - a).x();  // The cross product is exact: its integers are below 2^53.
    if (turn == 0) continue;
    const int side = turn > 0 ? 1 : -1;
    EXPECT_EQ(orientation(a, b, c, above), side);
    EXPECT_EQ(orientation(b, a, c, above), -side);
    EXPECT_EQ(orientation(a, b, above, c), -side);
  }
}

TEST(Orientation, IsExactNextToALine) {
  // Three points near a diagonal, a few units in the last place off it, are a classical test of robust
  // predicates.
  for (int i = 0; i < 100; ++i)
    for (int k = 0; k < 100; ++k) {
      const double ulp = std::numeric_limits<double>::epsilon() / 2;
      const Vec2 a(0.5 + i * ulp, 0.5 + k * ulp), b(12, 12), c(24, 24);
      EXPECT_EQ(orientation(a, b, c), (k > i) - (k < i));
    }
}

// Returns whether a triangle with the edge from p to q meets a triangle in the plane z = 0.
bool crosses(const Vec3& p, const Vec3& q) {
  const std::array<Vec3, 3> wall = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
  return triangles_meet({p, q, q + Vec3(1e-3, 1e-3, 5)}, wall);
}

TEST(TriangleIntersection, MatchesKnownCases) {
  EXPECT_TRUE(crosses(Vec3(0.2, 0.2, -1), Vec3(0.2, 0.2, 1)));
  EXPECT_FALSE(crosses(Vec3(0.2, 0.2, 1e-300), Vec3(0.2, 0.3, 1)));
  EXPECT_TRUE(crosses(Vec3(0.2, 0.2, 0), Vec3(0.2, 0.3, 1)));  // A corner is on the face.
  // The edge of one triangle passes through an edge of the other.
  EXPECT_TRUE(crosses(Vec3(0.5, 0.5, -1), Vec3(0.5, 0.5, 1)));
  EXPECT_FALSE(crosses(Vec3(0.5, std::nextafter(0.5, 1), -1), Vec3(0.5, std::nextafter(0.5, 1), 1)));
}

TEST(TriangleIntersection, IsExactForCoplanarTriangles) {
  const std::array<Vec3, 3> wall = {Vec3(0, 0, 2), Vec3(1, 0, 2), Vec3(0, 1, 2)};
  const auto moved = [&](double x, double y) {
    std::array<Vec3, 3> other = wall;
    for (Vec3& corner : other) corner += Vec3(x, y, 0);
    return other;
  };
  EXPECT_TRUE(triangles_meet(wall, moved(0.3, 0.3)));
  EXPECT_TRUE(triangles_meet(wall, moved(0, 0)));
  EXPECT_TRUE(triangles_meet(wall, moved(1, 0)));  // A corner meets a corner.
  EXPECT_FALSE(triangles_meet(wall, moved(std::nextafter(1.0, 2), 0)));
  const std::array<Vec3, 3> within = {Vec3(0.2, 0.2, 2), Vec3(0.3, 0.2, 2), Vec3(0.2, 0.3, 2)};
  EXPECT_TRUE(triangles_meet(wall, within));
  EXPECT_TRUE(triangles_meet(within, wall));
}

// The predicate agrees with the barycentric solution for the points where edges meet triangles, away from
// cases that rounding decides.
TEST(TriangleIntersection, AgreesWithALinearSolveOnRandomTriangles) {
  std::mt19937 random(6);
  const auto edge_meets = [](const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& t, double& margin) {
    Mat3 system;
    system << t[1] - t[0], t[2] - t[0], p - q;
    const Vec3 s = system.inverse() * (p - t[0]);
    const double least = std::min({s[0], s[1], 1 - s[0] - s[1], s[2], 1 - s[2]});
    margin = std::min(margin, std::abs(least));
    return least > 0;
  };
  int met = 0;
  for (int i = 0; i < 20000; ++i) {
    std::array<Vec3, 3> a, b;
    for (Vec3& x : a) x = random_vector(random);
    for (Vec3& x : b) x = random_vector(random);
    bool expected = false;
    double margin = 1;
    for (std::size_t k = 0; k < 3; ++k) {
      expected |= edge_meets(a[k], a[(k + 1) % 3], b, margin);
      expected |= edge_meets(b[k], b[(k + 1) % 3], a, margin);
    }
    if (margin < 1e-9) continue;
    EXPECT_EQ(triangles_meet(a, b), expected);
    met += expected;
  }
  EXPECT_GT(met, 1000);
}

TEST(TriangleIntersection, CountsPairsWithoutACommonVertex) {
  TriangleMesh mesh = test::box_mesh(Vec3::Zero(), Vec3::Ones());
  EXPECT_TRUE(intersecting_triangles(mesh.positions, mesh.triangles).empty());
  // A spike enters the lower face of the box (two triangles) off their diagonal, and ends inside.
  const int first = static_cast<int>(mesh.positions.size());
  for (const Vec3& x : {Vec3(0.7, 0.2, 0.5), Vec3(0.6, 0.1, -1), Vec3(0.8, 0.1, -1), Vec3(0.7, 0.3, -1)})
    mesh.positions.push_back(x);
  const int faces = static_cast<int>(mesh.triangles.size());
  for (int k = 0; k < 3; ++k) mesh.triangles.push_back({first, first + 1 + k, first + 1 + (k + 1) % 3});
  const auto pairs = intersecting_triangles(mesh.positions, mesh.triangles);
  ASSERT_EQ(pairs.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(pairs[k][0], pairs[0][0]);
    EXPECT_EQ(pairs[k][1], faces + static_cast<int>(k));
  }
}

}  // namespace
}  // namespace duet::triangle_intersection_test
