// Tests of the level-set files. OpenVDB itself reads them back, as other programs do.
#include "sim/io/level_set_writer.h"

#include <map>

#include <gtest/gtest.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/geometry/level_set/level_set.h"
#include "sim/scene/build/level_set_export.h"

namespace duet::io::level_set_writer_test {
namespace {

BodyLevelSet body(const std::string& name, const LevelSet& shape, double voxel_size, const Pose& pose) {
  return {.name = name,
          .distance = [shape](const Vec3& x) { return shape.distance(x); },
          .lower = shape.lower(),
          .upper = shape.upper(),
          .voxel_size = voxel_size,
          .pose = pose};
}

std::map<std::string, openvdb::FloatGrid::Ptr> read_grids(const fs::path& path) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open(/*delayLoad=*/false);
  std::map<std::string, openvdb::FloatGrid::Ptr> grids;
  const openvdb::GridPtrVecPtr all = file.getGrids();
  for (const auto& grid : *all) grids[grid->getName()] = openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
  file.close();
  return grids;
}

class LevelSetFile : public testing::Test {
 protected:
  static constexpr double voxel = 0.05;
  const LevelSet box = LevelSet::box(Vec3(1, 0.6, 2)), ball = LevelSet::sphere(0.4);
  const Pose pose{Vec3(3, -1, 0.5), Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()))};
  ScratchFolder scratch;
  RunDirectory run{scratch.path()};
  std::vector<BodyLevelSet> bodies = {body("box", box, voxel, pose), body("ball", ball, voxel, Pose{})};

  void SetUp() override { fs::create_directories(run.level_set(0).parent_path()); }
};

TEST_F(LevelSetFile, ValuesAreTheDistancesOfTheRotatedBox) {
  LevelSetWriter(bodies).write(run, 0, 0, bodies);
  const openvdb::FloatGrid::Ptr grid = read_grids(run.level_set(0)).at("box");
  const openvdb::tools::GridSampler<openvdb::FloatGrid, openvdb::tools::BoxSampler> sampler(*grid);
  const double band = 3 * voxel;
  int within_band = 0;
  for (double x = -2; x <= 2; x += 0.13)
    for (double y = -2; y <= 2; y += 0.13)
      for (double z = -2; z <= 2; z += 0.13) {
        const Vec3 world = pose.position + Vec3(x, y, z);
        const double exact = box.distance(pose.to_body(world));
        const double value =
            static_cast<double>(sampler.wsSample(openvdb::Vec3d(world.x(), world.y(), world.z())));
        // Trilinear interpolation of a distance is off by less than half a voxel, also at edges. Within one
        // voxel of the edge of the narrow band, some of the eight values are the background.
        if (std::abs(exact) < band - voxel) {
          EXPECT_NEAR(value, exact, 0.5 * voxel);
          ++within_band;
        } else {
          EXPECT_EQ(value < 0, exact < 0);
          EXPECT_LE(std::abs(value), band * (1 + 1e-6));
        }
      }
  EXPECT_GT(within_band, 500);
}

// Bodies of one shape share their voxels: ten boxes take hardly more space than one, and each of them has its
// own place. The bound allows 2000 bytes of metadata for each further box.
TEST_F(LevelSetFile, BodiesOfOneShapeShareTheirVoxels) {
  bodies.resize(1);
  LevelSetWriter(bodies).write(run, 0, 0, bodies);
  const auto size_of_one = fs::file_size(run.level_set(0));
  for (int i = 1; i < 10; ++i) {
    bodies.push_back(
        body("box" + std::to_string(i), box, voxel, Pose{Vec3(3.0 * i, 0, 0), Quat::Identity()}));
    bodies.back().same_as = 0;
  }
  LevelSetWriter(bodies).write(run, 1, 0, bodies);
  EXPECT_LT(fs::file_size(run.level_set(1)), size_of_one + 9 * 2000);
  const auto grids = read_grids(run.level_set(1));
  ASSERT_EQ(grids.size(), 10u);
  for (int i = 1; i < 10; ++i) {
    const openvdb::FloatGrid& grid = *grids.at("box" + std::to_string(i));
    EXPECT_EQ(grid.activeVoxelCount(), grids.at("box")->activeVoxelCount());
    const openvdb::Vec3d center = grid.indexToWorld(openvdb::Vec3d(0, 0, 0));
    EXPECT_DOUBLE_EQ(center.x(), 3.0 * i);
  }
}

// At the voxels themselves the value is the distance, to the precision of a float.
TEST_F(LevelSetFile, VoxelsAreExact) {
  LevelSetWriter(bodies).write(run, 0, 0, bodies);
  const openvdb::FloatGrid::Ptr grid = read_grids(run.level_set(0)).at("box");
  int voxels = 0;
  for (auto value = grid->cbeginValueOn(); value; ++value, ++voxels) {
    const openvdb::Vec3d at = grid->indexToWorld(value.getCoord());
    const double exact = box.distance(pose.to_body(Vec3(at.x(), at.y(), at.z())));
    ASSERT_NEAR(static_cast<double>(*value), exact, 1e-7);  // |value| <= 0.15, where floats are 1.5e-8 apart
  }
  const double surface = 2 * (1 * 0.6 + 0.6 * 2 + 1 * 2);
  EXPECT_NEAR(voxels, surface * 6 / (voxel * voxel), 0.15 * voxels)
      << "six layers of voxels around the surface";
}

TEST_F(LevelSetFile, GridsCarryNamesMetadataAndThePose) {
  LevelSetWriter writer(bodies);
  writer.write(run, 0, 0, bodies);
  bodies[0].pose.position += Vec3(0, 10, 0);
  writer.write(run, 12, 0.5, bodies);
  auto first = read_grids(run.level_set(0)), later = read_grids(run.level_set(12));
  ASSERT_EQ(later.size(), 2U);
  ASSERT_TRUE(later.contains("ball"));
  for (const auto& [name, grid] : later) {
    EXPECT_EQ(grid->getGridClass(), openvdb::GRID_LEVEL_SET);
    EXPECT_EQ(grid->metaValue<std::int32_t>("frame"), 12);
    EXPECT_EQ(grid->metaValue<double>("time"), 0.5);
    EXPECT_NE(grid->metaValue<std::string>("units").find("metres"), std::string::npos);
    EXPECT_NEAR(grid->background(), 3 * voxel, 1e-7);
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(grid->voxelSize()[axis], voxel, 1e-12);
  }
  const openvdb::Vec3d origin = later["box"]->indexToWorld(openvdb::Vec3d(0, 0, 0));
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(origin[axis], bodies[0].pose.position[axis], 1e-12);
  // The voxels are those of the first frame: a change of pose resamples nothing.
  EXPECT_TRUE(first["box"]->tree().hasSameTopology(later["box"]->tree()));
  for (auto a = first["box"]->cbeginValueOn(), b = later["box"]->cbeginValueOn(); a; ++a, ++b)
    ASSERT_EQ(*a, *b);
}

TEST_F(LevelSetFile, NamesCanBeLookedUpWithoutReadingTheGrids) {
  LevelSetWriter(bodies).write(run, 0, 0, bodies);
  openvdb::initialize();
  openvdb::io::File file(run.level_set(0).string());
  file.open(/*delayLoad=*/false);
  EXPECT_TRUE(file.hasGrid("box"));
}

// The middle plane of a body lies on nodes of its grid, so that even a plate thinner than a voxel has an
// inside.
TEST_F(LevelSetFile, APlateThinnerThanAVoxelHasAnInside) {
  bodies = {body("box", LevelSet::box(Vec3(1, 0.004, 1)), voxel, pose)};
  LevelSetWriter(bodies).write(run, 0, 0, bodies);
  const openvdb::FloatGrid::Ptr grid = read_grids(run.level_set(0)).at("box");
  for (int i = -9; i <= 9; ++i)
    for (int k = -9; k <= 9; ++k) {
      EXPECT_NEAR(grid->tree().getValue({i, 0, k}), -0.002F, 1e-6F);
      EXPECT_GT(grid->tree().getValue({i, 1, k}), 0);
      EXPECT_GT(grid->tree().getValue({i, 12, k}), 0);
    }
}

// OpenVDB refuses transforms with tiny voxels. A grain 0.1 mm wide is still written.
TEST_F(LevelSetFile, TheSmallestGrainsAreWritten) {
  const LevelSet grain = LevelSet::sphere(5e-5);
  bodies = {body("box", grain, exported_voxel_size(grain), pose)};
  LevelSetWriter(bodies).write(run, 0, 0, bodies);
  EXPECT_NEAR(read_grids(run.level_set(0)).at("box")->tree().getValue({0, 0, 0}), -5e-5F, 1e-9F);
}

TEST_F(LevelSetFile, BodiesThatNeverMoveAreWrittenOnce) {
  bodies.push_back(body("second box", box, voxel, Pose{}));
  bodies[2].same_as = 0;
  bodies[2].is_static = true;
  LevelSetWriter writer(bodies);
  writer.write(run, 3, 0.1, bodies);
  const auto moving = read_grids(run.level_set(3)), fixed = read_grids(run.static_level_sets());
  EXPECT_EQ(moving.size(), 2U);
  EXPECT_TRUE(moving.contains("box") && moving.contains("ball"));
  ASSERT_EQ(fixed.size(), 1U);
  const openvdb::FloatGrid& grid = *fixed.at("second box");
  EXPECT_FALSE(grid["frame"]) << "it is of all frames";
  EXPECT_EQ(grid.activeVoxelCount(), moving.at("box")->activeVoxelCount());
  write_atomically(run.static_level_sets(), "mark");
  writer.write(run, 4, 0.2, bodies);
  EXPECT_EQ(read_file(run.static_level_sets()), "mark");
}

TEST_F(LevelSetFile, WithoutBodiesThatMoveOrRestThereIsNoFile) {
  write_atomically(run.static_level_sets(), "of another run");
  LevelSetWriter(bodies).write(run, 0, 0, bodies);
  EXPECT_FALSE(fs::exists(run.static_level_sets()));
  for (BodyLevelSet& each : bodies) each.is_static = true;
  LevelSetWriter(bodies).write(run, 0, 0, bodies);
  EXPECT_TRUE(fs::exists(run.static_level_sets()));
  EXPECT_FALSE(fs::exists(run.level_set(0)));
}

TEST_F(LevelSetFile, AWriteThatFailsIsAFileError) {
  EXPECT_THROW(LevelSetWriter(bodies).write({"/proc/duet-test"}, 0, 0, bodies), FileError);
}

}  // namespace
}  // namespace duet::io::level_set_writer_test
