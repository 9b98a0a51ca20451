#include "sim/geometry/mesh/triangle_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

#include "sim/base/dot_in_order.h"
#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/queries/triangle_tree.h"

namespace duet::triangle_mesh_test {
namespace {

Vec3 sorted(Vec3 v) {
  std::sort(v.data(), v.data() + 3);
  return v;
}

// Second moments about the origin are 1e4 times as large here as those about the center of mass, and sums
// about it would lose four digits. mass_properties() sums about a vertex.
TEST(MassOfMesh, IsAccurateFarFromTheOrigin) {
  const Vec3 lower(100, -20, 7);
  const MassProperties mass = mass_properties(test::box_mesh(lower, lower + Vec3::Ones()));
  EXPECT_NEAR(mass.volume, 1, 1e-12);
  EXPECT_LT((mass.frame.position - (lower + Vec3::Constant(0.5))).norm(), 1e-12);
  EXPECT_LT((mass.unit_inertia - Vec3::Constant(1.0 / 6)).norm(), 1e-12);
  EXPECT_EQ(mass.frame.orientation.coeffs(), Quat::Identity().coeffs()) << "its axes are principal already";
}

// The corner tetrahedron of the unit cube has volume 1/6 and center (1/4, 1/4, 1/4). Per unit mass about the
// center, <x x> - <x>^2 = 1/10 - 1/16 = 3/80 and <x y> - <x><y> = 1/20 - 1/16 = -1/80. The eigenvalues of
// this covariance are 3/80 - 2/80 = 1/80 (along the diagonal) and 4/80 twice. The moments of inertia are the
// trace 9/80 less the eigenvalues: 8/80 and 5/80 twice.
TEST(MassOfMesh, CornerTetrahedronHasItsKnownMoments) {
  const MassProperties mass =
      mass_properties(test::tetrahedron(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()));
  EXPECT_NEAR(mass.volume, 1.0 / 6, 1e-15);
  EXPECT_LT((mass.frame.position - Vec3::Constant(0.25)).norm(), 1e-15);
  EXPECT_LT((sorted(mass.unit_inertia) - Vec3(5, 5, 8) / 80).norm(), 1e-15);
  int axis = 0;
  mass.unit_inertia.maxCoeff(&axis);
  const Vec3 diagonal = mass.frame.orientation * Vec3::Unit(axis);
  EXPECT_NEAR(std::abs(diagonal.dot(Vec3::Ones().normalized())), 1, 1e-12);
}

TEST(MassOfMesh, TorusConvergesToTheFormula) {
  const LevelSet torus = LevelSet::torus(1, 0.3);
  double last = 0;
  for (const int n : {32, 64}) {
    const MassProperties mass = mass_properties(test::torus_mesh(1, 0.3, 2 * n, n));
    const double error = std::abs(mass.volume - volume(torus)) / volume(torus) +
                         (mass.unit_inertia - unit_inertia(torus)).norm();
    if (last > 0) {
      // The facets cut off a volume of second order, so that halving them quarters the error.
      EXPECT_NEAR(last / error, 4, 0.1);
      EXPECT_LT(error, 0.01);
    }
    last = error;
  }
}

// Volume, center and principal moments are those of the body, whatever frame its mesh is given in, up to
// rounding.
TEST(MassOfMesh, DoesNotDependOnTheFrame) {
  const TriangleMesh mesh = test::l_mesh();
  const MassProperties mass = mass_properties(mesh);
  EXPECT_NEAR(mass.volume, 3, 1e-14);
  EXPECT_TRUE(mass.frame.position.isApprox(Vec3(5.0 / 6, 5.0 / 6, 0.5)));
  std::mt19937 random(11);
  for (int i = 0; i < 20; ++i) {
    const Pose pose{test::random_vector(random), test::random_rotation(random)};
    const MassProperties moved = mass_properties(in_frame(mesh, 1, pose));
    EXPECT_NEAR(moved.volume, 3, 1e-13);
    EXPECT_LT((pose.to_world(moved.frame.position) - mass.frame.position).norm(), 1e-13);
    EXPECT_LT((sorted(moved.unit_inertia) - sorted(mass.unit_inertia)).norm(), 1e-13);
    EXPECT_NEAR(moved.frame.orientation.toRotationMatrix().determinant(), 1, 1e-13);
  }
}

// In the frame that mass_properties() returns, the center of mass is at the origin and the axes are
// principal.
TEST(MassOfMesh, BodyFrameIsCenteredAndPrincipal) {
  const TriangleMesh mesh = test::l_mesh();
  const MassProperties mass = mass_properties(in_frame(mesh, 2, Pose{}));
  EXPECT_NEAR(mass.volume, 8 * 3, 1e-12) << "scaled by 2";
  const TriangleMesh body = in_frame(mesh, 2, mass.frame);
  const MassProperties in_body = mass_properties(body);
  EXPECT_LT(in_body.frame.position.norm(), 1e-14);
  EXPECT_LT((in_body.unit_inertia - mass.unit_inertia).norm(), 1e-13);
  EXPECT_LT((mass.frame.to_world(body.positions[3]) - 2 * mesh.positions[3]).norm(), 1e-14);
}

// The tree finds the same nearest point as a search of all triangles, to the last bit.
TEST(TriangleTree, FindsTheNearestPoint) {
  const TriangleMesh mesh = test::torus_mesh(1, 0.4, 16, 9);
  const TriangleTree tree(mesh);
  std::mt19937 random(13);
  for (int i = 0; i < 500; ++i) {
    const Vec3 x = 2 * test::random_vector(random);
    double least = 1e9;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      least =
          std::min(least, std::sqrt(square_in_order(x - nearest_point(mesh.corner(t, 0), mesh.corner(t, 1),
                                                                      mesh.corner(t, 2), x))));
    const TriangleTree::Nearest nearest = tree.nearest(x);
    EXPECT_EQ(nearest.distance, least);
    EXPECT_EQ(std::sqrt(square_in_order(x - nearest.point)), least);
    const auto t = static_cast<std::size_t>(nearest.triangle);
    EXPECT_EQ(nearest_point(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2), x), nearest.point);
  }
}

// The distance is the same to the last bit for every bound on the search: the true distance, a greater one,
// none, and a smaller one, which a caller can pass by mistake.
TEST(TriangleTree, FindsTheSameDistanceWithinABound) {
  const TriangleTree trees[] = {TriangleTree(test::torus_mesh(1, 0.4, 16, 9)),
                                TriangleTree(test::box_mesh(Vec3::Zero(), Vec3(1, 2, 3)))};
  std::mt19937 random(19);
  for (int i = 0; i < 3000; ++i) {
    const TriangleTree& tree = trees[i % 2];
    const Vec3 x = 2 * test::random_vector(random);
    const double distance = tree.nearest(x).distance;
    for (const double at_most :
         {distance, 1.5 * distance, std::numeric_limits<double>::infinity(), 0.5 * distance}) {
      const TriangleTree::Nearest nearest = tree.nearest(x, at_most);
      EXPECT_EQ(nearest.distance, distance);
      EXPECT_EQ(std::sqrt(square_in_order(x - nearest.point)), distance);
    }
  }
}

// The nearest point is at most as far as every node of a fine lattice over the triangle, and nearer by no
// more than the spacing of the lattice.
TEST(TriangleTree, NearestPointOfATriangle) {
  std::mt19937 random(17);
  for (int i = 0; i < 200; ++i) {
    const Vec3 a = test::random_vector(random), b = test::random_vector(random),
               c = test::random_vector(random), x = 2 * test::random_vector(random);
    const double found = (nearest_point(a, b, c, x) - x).norm();
    double least = 1e9;
    constexpr int n = 60;
    for (int j = 0; j <= n; ++j)
      for (int k = 0; j + k <= n; ++k)
        least = std::min(least, (a + (b - a) * j / n + (c - a) * k / n - x).norm());
    EXPECT_LE(found, least + 1e-14);
    EXPECT_GE(found, least - 3.5 / n);  // Edges are shorter than 3.5.
  }
}

}  // namespace
}  // namespace duet::triangle_mesh_test
