// Tests of `duet tetrahedralize`: its output can be simulated, its report is true, and bad meshes are named.
#include "tests/restart/program.h"
#include "tests/support/places.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/geometry/files/tet_mesh_file.h"
#include "sim/geometry/mesh/tet_quality.h"
#include "sim/io/run_directory.h"

namespace duet::test::tetrahedralize_test {
namespace {

const std::string bracket = source_folder() + "/assets/bracket.obj";

TEST(Tetrahedralize, ReportsTheMeshThatItWrites) {
  const ScratchFolder scratch;
  const Finished finished =
      run_duet({"tetrahedralize", bracket, "bracket.mesh", "--cells", "20", "--json"}, scratch.path());
  ASSERT_EQ(finished.status, 0) << finished.errors;
  const auto report = nlohmann::json::parse(finished.output.front());
  const TetMesh mesh = read_tet_mesh((scratch / "bracket.mesh").string());
  const TetQuality quality = tet_quality(mesh);
  EXPECT_EQ(report["tets"], mesh.tets.size());
  EXPECT_EQ(report["boundary_triangles"], boundary(mesh).size());
  EXPECT_EQ(report["least_dihedral_angle"], quality.min_angle);
  EXPECT_EQ(report["parts"], 1);
  EXPECT_NEAR(report["volume_error"], 0, 0.1);  // 20 cells leave five across an arm, whose edges are cut off.
}

TEST(Tetrahedralize, WhatItWritesIsABodyOfAScene) {
  const ScratchFolder scratch;
  const Finished made = run_duet({"tetrahedralize", bracket, "soft.mesh", "--graded"}, scratch.path());
  ASSERT_EQ(made.status, 0) << made.errors;
  EXPECT_EQ(made.last_line(), "done: wrote soft.mesh");
  io::write_atomically(scratch / "soft.toml",
                       "[materials.rubber]\n[[deformable]]\nname = \"soft\"\nmaterial = \"rubber\"\n"
                       "shape = { tets = \"soft.mesh\", scale = 0.5 }\n");
  EXPECT_EQ(run_duet({"sim", "soft.toml", "--frames", "1"}, scratch.path()).status, 0);
}

TEST(Tetrahedralize, NamesWhatIsWrong) {
  const ScratchFolder scratch;
  const std::string open = source_folder() + "/tests/broken/open_box.obj";
  const Finished flawed = run_duet({"tetrahedralize", open, "open.mesh"}, scratch.path());
  EXPECT_EQ(flawed.status, 2);
  EXPECT_NE(flawed.errors.find("4 open edges"), std::string::npos) << flawed.errors;
  EXPECT_FALSE(fs::exists(scratch / "open.mesh"));
  EXPECT_EQ(run_duet({"tetrahedralize", "absent.obj", "a.mesh"}, scratch.path()).status, 4);
  const Finished wide = run_duet({"tetrahedralize", bracket, "wide.mesh", "--spacing", "20"}, scratch.path());
  EXPECT_EQ(wide.status, 2);
  EXPECT_NE(wide.errors.find("--spacing 20: must be in ["), std::string::npos) << wide.errors;
}

}  // namespace
}  // namespace duet::test::tetrahedralize_test
