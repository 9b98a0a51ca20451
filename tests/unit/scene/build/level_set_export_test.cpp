#include "sim/scene/build/level_set_export.h"

#include <cmath>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

#include "sim/geometry/level_set/grid_level_set.h"

namespace duet::level_set_export_test {
namespace {

LevelSet mesh_plate(const Vec3& size) {
  return LevelSet::mesh(std::make_shared<GridLevelSet>(test::box_mesh(-size / 2, size / 2), 64));
}

TEST(LevelSetExport, CompactShapesAreFortyVoxelsThick) {
  for (const double size : {0.01, 1.0, 1e4}) {
    EXPECT_DOUBLE_EQ(exported_voxel_size(LevelSet::sphere(size)), size / 20);
    EXPECT_DOUBLE_EQ(exported_voxel_size(LevelSet::box(Vec3(size, size, 2 * size))), size / 40);
  }
}

// However thin a shape is, its surface bounds the number of voxels: at most 1e6 voxel faces on a sheet and
// 2e4 voxels along a wire.
TEST(LevelSetExport, TheSurfaceBoundsTheVoxels) {
  for (const double thickness : {0.1, 0.01, 1e-3, 1e-4, 1e-6}) {
    const double sheet = exported_voxel_size(LevelSet::box(Vec3(2, thickness, 2)));
    EXPECT_LT(8 / (sheet * sheet), 1.001e6) << thickness;
    EXPECT_GT(8 / (sheet * sheet), 5e4) << thickness;
    const double wire = exported_voxel_size(LevelSet::capsule(thickness / 2, 10));
    EXPECT_LT(10 / wire, 2.001e4) << thickness;
    const double mesh = exported_voxel_size(mesh_plate(Vec3(2, thickness, 2)));
    EXPECT_NEAR(mesh, 2.0 / 64, 1e-9) << "cells of its grid";
  }
}

// OpenVDB takes a matrix with a determinant below 3e-15 for a singular one.
TEST(LevelSetExport, NoVoxelIsTooSmallForOpenVdb) {
  for (const LevelSet& shape : {LevelSet::sphere(5e-5), LevelSet::box(Vec3(1e-2, 1e-4, 1e-2)),
                                LevelSet::torus(1e-3, 1e-5), mesh_plate(Vec3(1e-4, 1e-4, 1e-4))})
    EXPECT_GT(std::pow(exported_voxel_size(shape), 3), 1e-14);
}

TEST(LevelSetExport, APlateHasAnInsideInItsMiddle) {
  const Vec3 size(2, 0.002, 2);
  for (const LevelSet& plate : {LevelSet::box(size), mesh_plate(size)}) {
    const double voxel = exported_voxel_size(plate);
    EXPECT_GT(voxel, size.y());
    for (double x = 0; x < 0.99; x += voxel)
      for (double z = 0; z < 0.99; z += voxel)
        ASSERT_NEAR(plate.distance(Vec3(x, 0, z)), -0.001, 1e-12) << x << ' ' << z;
  }
}

}  // namespace
}  // namespace duet::level_set_export_test
