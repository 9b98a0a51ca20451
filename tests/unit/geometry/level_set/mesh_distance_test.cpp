#include "sim/geometry/level_set/mesh_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

#include "sim/base/rotation.h"

namespace duet::mesh_distance_test {
namespace {

using test::random_vector;

// The distance to a mesh of a box equals the formula up to rounding of numbers up to 2. The normal, where an
// edge or a corner is nearest, is rounded by that over the distance.
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

// Near an edge as sharp as a knife's, most outside points lie behind one of its two faces. A sign from the
// normal of the nearest triangle alone would call them inside.
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
    // Signed distance of the highest of the planes of the faces: negative inside of this convex body.
    double above = -std::numeric_limits<double>::infinity();
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
  // The normal does not depend on how many triangles of each face meet at the corner.
  EXPECT_LT((corner.normal - Vec3(1, 1, 1).normalized()).norm(), 1e-15);
}

// Above and below a flat place, the normal is that of its face, however near the point is: the difference
// between a point and its foot is all rounding there. A normal that was off by 1e-6 made a rail's side rise
// above its top, and bodies that lay on rails took it for a wall. A box in general orientation has a flat
// edge, the diagonal, in each face.
TEST(MeshDistance, NormalsOfFlatPlacesAreThoseOfTheirFaces) {
  std::mt19937 random(4);
  for (const double length : {1.0, 40.0, 1000.0}) {
    // Rounding of the corners in m. They are 0.1 m apart across the box.
    const double rounding = 1e-15 * length;
    const Vec3 half(length / 2, 0.05, 0.05);
    TriangleMesh box = test::box_mesh(-half, half);
    const Quat turn = exponential(Vec3(0.3, 0.7, 0.4));
    for (Vec3& x : box.positions) x = turn * x;
    const MeshDistance mesh(box);
    const Vec3 top = turn * Vec3(0, 1, 0), diagonal = turn * Vec3(length, 0, 0.1),
               other = turn * Vec3(length, 0, -0.1);
    for (const double height : {1e-12, 1e-10, 1e-8, 1e-6, 1e-4})
      for (const double sign : {-1.0, 1.0})
        for (int i = 0; i < 100; ++i) {
          const Vec3 at = random_vector(random);
          for (const Vec3& along : {Vec3(turn * Vec3(0.45 * length * at.x(), 0, 0.045 * at.z())),
                                    Vec3(0.45 * at.x() * diagonal), Vec3(0.45 * at.x() * other)}) {
            const SignedDistance found = mesh.at((0.05 + sign * height) * top + along);
            EXPECT_LT((found.normal - top).norm(), rounding / 0.05)
                << length << " m, " << sign * height << " m above";
            EXPECT_NEAR(found.distance, sign * height, rounding);
          }
        }
  }
}

// Beside the border of an open mesh, and level with it, the border is the nearest feature, and not the plane
// of the face.
TEST(MeshDistance, PlanesEndAtTheBordersOfOpenMeshes) {
  TriangleMesh sheet;
  sheet.positions = {Vec3(0, 0, 0), Vec3(0, 0, 1), Vec3(1, 0, 1), Vec3(1, 0, 0)};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  const MeshDistance mesh(sheet);
  for (const double height : {0.0, 1e-10, 0.1})
    for (const double beside : {1e-6, 0.2}) {
      const double along = std::hypot(beside, height), around = std::hypot(beside, beside, height);
      EXPECT_NEAR(std::abs(mesh.at(Vec3(1 + beside, height, 0.3)).distance), along, 1e-15) << "an edge";
      EXPECT_NEAR(std::abs(mesh.at(Vec3(1 + beside, height, 1 + beside)).distance), around, 1e-15)
          << "a corner";
    }
}

// The distance with a bound on the search equals the one without to the last bit, on both sides of the
// surface, if the bound is not smaller.
TEST(MeshDistance, ABoundOnTheSearchChangesNoBit) {
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
}  // namespace duet::mesh_distance_test
