#include "sim/embedding/carried_surface.h"

#include <gtest/gtest.h>

#include "sim/geometry/level_set/shape_mesh.h"
#include "sim/geometry/meshing/tetrahedralizer.h"

namespace duet::carried_surface_test {
namespace {

// The surface of a torus, embedded in tetrahedra of 8 cm.
struct Carried {
  LevelSet shape = LevelSet::torus(0.4, 0.15);
  TetMesh mesh = tetrahedralize(shape, 0.08);
  Surface surface = shape_surface(shape);
  CarriedSurface carried{surface, mesh};
};

// The barycentric weights sum to one and reproduce the positions, so they carry every affine map of the nodes
// over to the surface, whether a position lies inside of the coarse tetrahedra or beyond their flat faces.
TEST(CarriedSurface, FollowsAffineMapsExactly) {
  Carried test;
  Mat3 A;
  A << 1.3, 0.2, -0.4, 0.1, 0.7, 0.3, 0.5, -0.2, 1.1;
  const Vec3 b(3, -2, 1);
  for (Vec3& x : test.mesh.nodes) x = A * x + b;
  Surface moved = test.surface;
  test.carried.update(test.mesh.nodes.data(), moved);
  for (std::size_t i = 0; i < moved.positions.size(); ++i) {
    const Vec3 expected = A * test.surface.positions[i] + b;
    EXPECT_LT((moved.positions[i] - expected).norm(), 1e-12);
  }
  for (const Vec3f& n : moved.normals) EXPECT_NEAR(n.norm(), 1, 1e-5);
}

// The surface bulges out of the coarse boundary by its sagitta, a^2 / (8 R) for cells of the size a, while
// tetrahedra are some 0.4 cells high: barycentric weights of -0.4 are not reached.
TEST(CarriedSurface, LiesCloseToItsTets) {
  const Carried test;
  EXPECT_GT(test.carried.farthest_outside(), 0);
  EXPECT_LT(test.carried.farthest_outside(), 0.4);
}

// A constant is interpolated to itself, and a negative value, which marks inverted elements, reaches the
// surface without being averaged.
TEST(CarriedSurface, ValuesAreInterpolatedAndMarksAreKept) {
  const Carried test;
  std::vector<float> values, of_nodes(test.mesh.nodes.size(), 0.25F);
  test.carried.interpolate(of_nodes.data(), values);
  for (const float value : values) EXPECT_FLOAT_EQ(value, 0.25F);
  of_nodes[0] = -1;
  test.carried.interpolate(of_nodes.data(), values);
  for (const float value : values) EXPECT_TRUE(value > 0 || value == -1);
}

}  // namespace
}  // namespace duet::carried_surface_test
