#include "sim/geometry/mesh/tet_quality.h"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

namespace duet::tet_quality_test {
namespace {

constexpr double degrees = 180 / EIGEN_PI;

TEST(TetQuality, RegularTetHasItsKnownAnglesAndAltitude) {
  const TetMesh mesh{{{1, 1, 1}, {1, -1, -1}, {-1, -1, 1}, {-1, 1, -1}}, {{0, 1, 2, 3}}};
  const double edge = 2 * std::sqrt(2.0);
  for (const double angle : dihedral_angles(mesh, mesh.tets[0]))
    EXPECT_NEAR(angle, std::acos(1.0 / 3) * degrees, 1e-12);
  EXPECT_NEAR(min_altitude(mesh, mesh.tets[0]), edge * std::sqrt(2.0 / 3), 1e-14);
  const TetQuality quality = tet_quality(mesh);
  EXPECT_NEAR(quality.volume, edge * edge * edge / (6 * std::sqrt(2.0)), 1e-14);
  EXPECT_EQ(quality.angles[7], 6U);  // The class of angles from 70 to 80 degrees holds all six.
  EXPECT_NEAR(quality.shortest_edge, edge, 1e-15);
  EXPECT_NEAR(quality.longest_edge, edge, 1e-15);
}

// The corner of a cube has right dihedral angles at its three short edges and acos(1 / sqrt(3)) at the
// others. Its shortest altitude, 1 / sqrt(3), is the one on the slanted face.
TEST(TetQuality, CubeCornerHasItsKnownAnglesAndAltitude) {
  const TetMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2, 3}}};
  const TetQuality quality = tet_quality(mesh);
  EXPECT_NEAR(quality.min_angle, std::acos(1 / std::sqrt(3.0)) * degrees, 1e-12);
  EXPECT_NEAR(quality.max_angle, 90, 1e-12);
  EXPECT_NEAR(quality.min_altitude, 1 / std::sqrt(3.0), 1e-15);
}

// Angles of an almost flat tetrahedron keep their digits. A formula through the cosine would lose half of
// them near 180 degrees.
TEST(TetQuality, AnglesOfASliverKeepTheirDigits) {
  const double h = 1e-7;
  const TetMesh mesh{{{1, 0, h}, {-1, 0, h}, {0, 1, -h}, {0, -1, -h}}, {{0, 1, 3, 2}}};
  const TetQuality quality = tet_quality(mesh);
  // Two edges of length 2 cross at a distance of 2 h. Seen from either one, the ends of the other lie at +-1
  // across it and 2 h away.
  EXPECT_NEAR(180 - quality.max_angle, 2 * std::atan(2 * h) * degrees, 1e-12);
  EXPECT_GT(quality.min_angle, 0);
}

TEST(TetQuality, CountsEveryAngleOnce) {
  const TetMesh mesh = box_lattice(Vec3(1, 1, 1), Vec3i(2, 3, 4));
  const TetQuality quality = tet_quality(mesh);
  EXPECT_EQ(std::accumulate(quality.angles.begin(), quality.angles.end(), std::size_t{0}), 6 * quality.tets);
  EXPECT_EQ(quality.nodes, 3U * 4 * 5);
  EXPECT_EQ(tet_quality(TetMesh{}).tets, 0U);
}

}  // namespace
}  // namespace duet::tet_quality_test
