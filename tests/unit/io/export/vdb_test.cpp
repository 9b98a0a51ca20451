// Tests of exports of level sets: the grids, read by OpenVDB, have the distances of the bodies, where the
// stage beside them places them.
#include "tests/support/recorded_run.h"
#include "tests/support/scenes.h"
#include "tests/support/usd_reader.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <openvdb/tools/Interpolation.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/io/export/exporters.h"
#include "sim/io/export/vdb_grids.h"
#include "sim/io/level_set_writer.h"
#include "sim/io/vdb_file.h"

namespace duet::io::vdb_test {
namespace {

using Sampler = openvdb::tools::GridSampler<openvdb::FloatGrid, openvdb::tools::BoxSampler>;

double value_at(const openvdb::FloatGrid& grid, const Vec3& x) {
  return static_cast<double>(Sampler(grid).wsSample(openvdb::Vec3d(x.x(), x.y(), x.z())));
}

openvdb::FloatGrid::Ptr only_grid(const fs::path& path) {
  const std::vector<openvdb::FloatGrid::Ptr> grids = read_vdb(path);
  EXPECT_EQ(grids.size(), 1U) << path;
  EXPECT_EQ(grids.at(0)->getName(), "surface");
  EXPECT_EQ(grids.at(0)->getGridClass(), openvdb::GRID_LEVEL_SET);
  return grids.at(0);
}

// Runs of a scene with a body of each kind, with level sets as the program writes them.
class Vdb : public testing::Test {
 protected:
  RunDirectory record(int last) const {
    const RunDirectory run = test::record_run(scene, last, scratch / "run");
    const Simulation simulation(scene, test::plan(scene));
    create_folder(run.level_set(0).parent_path());
    const std::vector<BodyLevelSet> bodies = simulation.level_sets();
    LevelSetWriter(bodies).write(run, 0, 0, bodies);
    return run;
  }
  ExportNotes write(const ExportedRun& run, double voxel) const {
    FormatOptions options;
    options.voxel = voxel;
    fs::remove_all(folder);
    create_folder(folder);
    return export_vdb(run, options, folder);
  }
  static nlohmann::json body(const nlohmann::json& description, const std::string& name) {
    for (const nlohmann::json& body : description.at("bodies"))
      if (body.at("name") == name) return body;
    ADD_FAILURE() << name;
    return {};
  }

  const ScratchFolder scratch;
  const fs::path folder = scratch / "vdb";
  const scene::Scene scene = test::one_of_each(Vec3(500, 3, -200));
};

// Vertices lie on the surface, and points off them along the normal at that distance: at each frame, when the
// stage has moved the one grid of the shape.
TEST_F(Vdb, TheStageMovesTheGridsOfRigidBodies) {
  const RunDirectory directory = record(3);
  for (const char up : {'y', 'z'}) {
    ExportChoice choice;
    choice.up = up;
    choice.scale = up == 'z' ? 100 : 1;
    const ExportedRun run(directory, choice);
    write(run, 0);
    const test::Usda stage(folder / "run.usda");
    const auto description = nlohmann::json::parse(read_file(folder / "export.json"));
    int checked = 0;
    for (const int frame : run.frames()) {
      const FrameValues values = run.read(frame);
      for (const ExportedBody& exported : run.bodies()) {
        if (!exported.is_rigid()) continue;
        const std::string prim = "/run/bodies/" + exported.name,
                          field = prim + "/" + exported.name + "/surface";
        const std::string file = body(description, exported.name).at("level_set");
        EXPECT_EQ(stage.text(field, "filePath", 0), "@./" + file + "@");
        EXPECT_EQ(stage.text(field, "fieldName", 0), "\"surface\"");
        const openvdb::FloatGrid::Ptr grid = only_grid(folder / file);
        const double voxel = body(description, exported.name).at("voxel");
        EXPECT_NEAR(grid->voxelSize()[0], voxel, 1e-12 * voxel);
        const Vec3 translate = stage.vectors(prim, "xformOp:translate", frame).at(0);
        const std::vector<double> q = stage.numbers(prim, "xformOp:orient", frame);
        Surface surface = exported.rest;
        place(exported, values, surface);
        const Quat to_body = Quat(q[0], q[1], q[2], q[3]).conjugate();
        for (const auto& triangle : surface.triangles) {
          const Vec3 at = (surface.positions[static_cast<std::size_t>(triangle[0].position)] +
                           surface.positions[static_cast<std::size_t>(triangle[1].position)] +
                           surface.positions[static_cast<std::size_t>(triangle[2].position)]) /
                          3;
          const Vec3 normal = surface.normals[static_cast<std::size_t>(triangle[0].normal)].cast<double>();
          for (const double out : {-1.0, 0.0, 1.0}) {
            EXPECT_NEAR(value_at(*grid, to_body * (at + out * voxel * normal - translate)), out * voxel,
                        0.5 * voxel)
                << exported.name << " at frame " << frame;
            ++checked;
          }
        }
      }
    }
    EXPECT_GT(checked, 100);
    EXPECT_EQ(body(description, "box1").at("level_set"), body(description, "box2").at("level_set"));
    EXPECT_NE(body(description, "box1").at("level_set"), body(description, "box3").at("level_set"));
    EXPECT_TRUE(fs::exists(folder / "transforms.json"));
    EXPECT_FALSE(fs::exists(folder / "frames"));
  }
}

TEST_F(Vdb, DeformableBodiesHaveAGridAFrameIfAsked) {
  const RunDirectory directory = record(2);
  ExportChoice choice;
  choice.bodies = {"soft*"};
  choice.scale = 10;
  const ExportedRun run(directory, choice);
  ASSERT_EQ(run.bodies().size(), 1U);
  const ExportedBody& soft = run.bodies()[0];
  const double voxel = 0.02;
  EXPECT_TRUE(write(run, voxel).empty());
  const test::Usda stage(folder / "run.usda");
  for (const int frame : run.frames()) {
    const std::string file = "frames/" + soft.name + ".000" + std::to_string(frame) + ".vdb";
    EXPECT_EQ(stage.text("/run/bodies/" + soft.name + "/" + soft.name + "/surface", "filePath", frame),
              "@./" + file + "@");
    const openvdb::FloatGrid::Ptr grid = only_grid(folder / file);
    EXPECT_NEAR(grid->voxelSize()[0], 10 * voxel, 1e-12);
    Surface surface = soft.rest;
    place(soft, run.read(frame), surface);
    Eigen::AlignedBox3d box;
    for (const Vec3& x : surface.positions) {
      EXPECT_NEAR(value_at(*grid, x), 0, 10 * voxel);
      box.extend(x);
    }
    EXPECT_LT(value_at(*grid, box.center()), -10 * voxel);
    EXPECT_GT(value_at(*grid, box.max() + Vec3::Constant(10 * voxel)), 0);
  }
}

TEST_F(Vdb, SaysWhatHasNoLevelSet) {
  const RunDirectory directory = record(1);
  const ExportedRun run(directory, {});
  const ExportNotes without = write(run, 0);
  ASSERT_EQ(without.size(), 1U);
  EXPECT_NE(without[0].find("--voxel"), std::string::npos) << without[0];
  const auto refused = [&](const char* bodies, double voxel) -> std::string {
    ExportChoice choice;
    choice.bodies = {bodies};
    try {
      write(ExportedRun(directory, choice), voxel);
    } catch (const Error& error) {
      EXPECT_EQ(error.status(), ExitStatus::usage);
      return error.what();
    }
    ADD_FAILURE() << "not refused";
    return {};
  };
  EXPECT_NE(refused("soft*", 0).find("--voxel 0.02"), std::string::npos);
  EXPECT_NE(refused("soft*", 1e-5).find("or wider"), std::string::npos);
}

TEST_F(Vdb, MissingAndForeignLevelSetsAreRefused) {
  const RunDirectory directory = record(1);
  const auto refused = [&](const std::string& said) {
    try {
      write(ExportedRun(directory, {}), 0);
      ADD_FAILURE() << "not refused";
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find(said), std::string::npos) << error.what();
    }
  };
  const std::string whole = read_file(directory.level_set(0));
  write_atomically(directory.level_set(0), whole.substr(0, whole.size() / 2));
  refused("0000.vdb");
  std::vector<BodyLevelSet> bodies = Simulation(scene, test::plan(scene)).level_sets();
  for (BodyLevelSet& body : bodies)
    if (!body.is_static) body.pose.position.y() += 1;
  LevelSetWriter(bodies).write(directory, 0, 0, bodies);
  refused("0000.vdb: box1 is not where values/ has it");
  fs::remove(directory.level_set(0));
  refused("has no level set of box1");
}

// A tetrahedron has an inside, unless it lacks a triangle.
TEST_F(Vdb, SurfacesWithOpenEdgesHaveNoInside) {
  Surface solid;
  for (int i = 0; i < 4; ++i) solid.positions.emplace_back(i == 1, i == 2, i == 3);
  const auto add = [&](int a, int b, int c) {
    solid.triangles.push_back({Corner{a, 0, 0}, Corner{b, 0, 0}, Corner{c, 0, 0}});
  };
  add(0, 2, 1);
  add(0, 1, 3);
  add(0, 3, 2);
  EXPECT_FALSE(has_inside(solid));
  add(1, 2, 3);
  EXPECT_TRUE(has_inside(solid));
}

}  // namespace
}  // namespace duet::io::vdb_test
