#include "sim/geometry/mesh_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

namespace duet {
namespace {

using test::random_vector;

// Rounding of numbers up to 2; of the normal, that over the distance.
TEST(MeshDistance, OfABoxIsThatOfItsFormula) {
  const Vec3 half(1, 0.5, 0.25);
  const MeshDistance mesh(test::box_mesh(-half, half));
  const LevelSet box = LevelSet::box(2 * half);
  std::mt19937 random(1);
  for (int i = 0; i < 5000; ++i) {
    const Vec3 x = 1.5 * random_vector(random);
    const SignedDistance at = mesh.at(x);
    EXPECT_NEAR(at.distance, box.distance(x), 1e-15);
    EXPECT_LT((at.normal - box.normal(x)).norm(), 1e-15 / std::abs(at.distance) + 1e-15);
  }
}

// Near an edge as sharp as a knife's most points lie behind one of its two faces, though outside.
TEST(MeshDistance, KnowsTheSidesOfAKnifeEdge) {
  const TriangleMesh blade =
      test::tetrahedron(Vec3(0, 0.02, 1), Vec3(0, -0.02, 1), Vec3(-1, 0, 0), Vec3(1, 0, 0));
  const double sense = mass_properties(blade).volume > 0 ? 1 : -1;
  TriangleMesh mesh = blade;
  if (sense < 0)
    for (Triangle& t : mesh.triangles) std::swap(t[0], t[1]);
  const MeshDistance distance(mesh);
  std::mt19937 random(2);
  int inside = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 x = Vec3(0, 0, 0.2) + random_vector(random).cwiseProduct(Vec3(1, 0.05, 0.5));
    double above = -std::numeric_limits<double>::infinity();  // the highest of the planes of its faces
    for (std::size_t t = 0; t < 4; ++t)
      above = std::max(above, area_vector(mesh, t).normalized().dot(x - mesh.corner(t, 0)));
    inside += above < 0;
    if (std::abs(above) > 1e-12) {
      EXPECT_EQ(distance.at(x).distance < 0, above < 0) << x.transpose();
    }
  }
  EXPECT_GT(inside, 1000);
}

TEST(MeshDistance, OnTheSurfaceHasTheNormalsOfItsFeatures) {
  const MeshDistance mesh(test::box_mesh(Vec3::Zero(), Vec3(1, 2, 4)));
  const SignedDistance face = mesh.at(Vec3(0.25, 0.5, 4)), edge = mesh.at(Vec3(1, 0.5, 4)),
                       corner = mesh.at(Vec3(1, 2, 4));
  EXPECT_EQ(face.distance, 0);
  EXPECT_EQ(edge.distance, 0);
  EXPECT_EQ(corner.distance, 0);
  EXPECT_LT((face.normal - Vec3(0, 0, 1)).norm(), 1e-15);
  EXPECT_LT((edge.normal - Vec3(1, 0, 1).normalized()).norm(), 1e-15);
  // However many triangles of a face meet there.
  EXPECT_LT((corner.normal - Vec3(1, 1, 1).normalized()).norm(), 1e-15);
}

// On both sides, to the last bit.
TEST(MeshDistance, IsTheSameWithinABound) {
  const MeshDistance mesh(test::torus_mesh(1, 0.4, 16, 9));
  std::mt19937 random(3);
  int inside = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 x = 1.5 * random_vector(random).cwiseProduct(Vec3(1, 0.4, 1));
    const double distance = mesh.at(x).distance;
    inside += distance < 0;
    EXPECT_EQ(mesh.distance(x, std::abs(distance)), distance);
    EXPECT_EQ(mesh.distance(x, std::abs(distance) + 0.3), distance);
  }
  EXPECT_GT(inside, 500);
}

}  // namespace
}  // namespace duet
