#include "sim/geometry/mesh/tet_mesh.h"

#include <cmath>
#include <map>

#include "tests/support/closed_surface.h"
#include <gtest/gtest.h>

#include "sim/geometry/mesh/tet_quality.h"

namespace duet::tet_mesh_test {
namespace {

const Vec3& node(const TetMesh& mesh, int i) { return mesh.nodes[static_cast<std::size_t>(i)]; }

TEST(TetMesh, LatticeFillsTheBoxWithPositiveTets) {
  const TetMesh mesh = box_lattice(Vec3(2, 1, 3), Vec3i(3, 2, 4));
  EXPECT_EQ(mesh.nodes.size(), 4u * 3 * 5);
  EXPECT_EQ(mesh.tets.size(), 5u * 3 * 2 * 4);
  double total = 0;
  for (const Tet& t : mesh.tets) {
    const double v = tet_volume(node(mesh, t[0]), node(mesh, t[1]), node(mesh, t[2]), node(mesh, t[3]));
    EXPECT_GT(v, 0);
    total += v;
  }
  EXPECT_NEAR(total, 6, 1e-13);
}

TEST(TetMesh, BoundaryIsClosedOutwardAndOfTheRightArea) {
  const TetMesh mesh = box_lattice(Vec3(2, 1, 3), Vec3i(3, 2, 4));
  const std::vector<Triangle> triangles = boundary(mesh);
  // Each cell face has two triangles, since the diagonals of adjacent cells match.
  EXPECT_EQ(triangles.size(), 2u * 2 * (3 * 2 + 2 * 4 + 4 * 3));
  std::map<std::pair<int, int>, int> edges;
  double area = 0;
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    const Vec3 normal = (node(mesh, t[1]) - node(mesh, t[0])).cross(node(mesh, t[2]) - node(mesh, t[0]));
    area += normal.norm() / 2;
    // The box is centered at the origin, so that outward normals point away from it.
    EXPECT_GT(normal.dot(node(mesh, t[0]) + node(mesh, t[1]) + node(mesh, t[2])), 0);
  }
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first}));
  }
  EXPECT_NEAR(area, 2 * (2 * 1 + 1 * 3 + 3 * 2), 1e-12);
}

TEST(TetMesh, EveryPatternFillsTheBoxWithTheAnglesItStates) {
  struct Stated {
    LatticePattern pattern;
    std::size_t tets;             // number of tetrahedra of a lattice of 3 x 2 x 4 cells
    double min_angle, max_angle;  // dihedral angles in degrees, for cubic cells
  };
  // Dihedral angle at the slanted face of a cube's corner, cut off.
  const double corner = std::acos(1 / std::sqrt(3.0)) * 180 / EIGEN_PI;
  // A body-centered cubic lattice has four tetrahedra for each of the 46 inner faces of cells and two for
  // each of the 52 outer ones.
  for (const Stated& stated : {Stated{LatticePattern::five, 5 * 24, corner, 90},
                               {LatticePattern::six, 6 * 24, 45, 90},
                               {LatticePattern::bcc, 4 * 46 + 2 * 52, 45, 120}}) {
    const TetMesh mesh = box_lattice(Vec3(3, 2, 4), Vec3i(3, 2, 4), stated.pattern);
    const TetQuality quality = tet_quality(mesh);
    EXPECT_EQ(quality.tets, stated.tets);
    EXPECT_NEAR(quality.volume, 24, 1e-12);
    EXPECT_NEAR(quality.min_angle, stated.min_angle, 1e-10);
    EXPECT_NEAR(quality.max_angle, stated.max_angle, 1e-10);
    // Each outer cell face has two triangles: the tetrahedra of adjacent cells match.
    EXPECT_EQ(boundary(mesh).size(), 104U);
    EXPECT_TRUE(test::is_closed_manifold(boundary(mesh)));
    for (const Tet& tet : mesh.tets) EXPECT_GT(volume(mesh, tet), 0);
  }
}

TEST(TetMesh, BoundarySamplesAreDistinctAndOnTheBox) {
  const TetMesh mesh = box_lattice(Vec3(2, 2, 2), Vec3i(2, 2, 2));
  const std::vector<Triangle> triangles = boundary(mesh);
  const std::vector<BoundarySample> samples = boundary_samples(mesh, triangles, 4);
  // There are 3 samples on each edge and 3 on each face.
  EXPECT_EQ(samples.size(), triangles.size() * 3 / 2 * 3 + triangles.size() * 3);
  std::vector<Vec3> points;
  for (const BoundarySample& s : samples) {
    EXPECT_NEAR(s.weight[0] + s.weight[1] + s.weight[2], 1, 1e-15);
    Vec3 x = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k) x += s.weight[k] * node(mesh, s.node[k]);
    EXPECT_NEAR(x.cwiseAbs().maxCoeff(), 1, 1e-14);
    for (const Vec3& other : points) EXPECT_GT((x - other).norm(), 1e-3);
    points.push_back(x);
  }
}

TEST(TetMesh, RenderSurfaceKeepsSharpEdgesAndFollowsThePositions) {
  const TetMesh mesh = box_lattice(Vec3(2, 2, 2), Vec3i(2, 2, 2));
  BoundarySurface result = boundary_surface(mesh, boundary(mesh));
  EXPECT_EQ(result.surface.positions.size(), 26u);
  EXPECT_EQ(result.surface.normals.size(), 6u * 9);  // Every face of the box has normals of its own.
  for (const Vec3f& n : result.surface.normals) EXPECT_NEAR(n.cwiseAbs().maxCoeff(), 1, 1e-6);
  for (Vec3& x : result.surface.positions) x = Vec3(-x.y(), x.x(), x.z());  // This is a quarter turn about z.
  const std::vector<Vec3f> before = result.surface.normals;
  update_normals(result.surface);
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_LT((result.surface.normals[i] - Vec3f(-before[i].y(), before[i].x(), before[i].z())).norm(), 1e-6);
}

}  // namespace
}  // namespace duet::tet_mesh_test
