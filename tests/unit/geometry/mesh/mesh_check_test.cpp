#include "sim/geometry/mesh/mesh_check.h"

#include <cmath>

#include "tests/support/meshes.h"
#include <gtest/gtest.h>

namespace duet::mesh_check_test {
namespace {

TriangleMesh box() { return test::box_mesh(Vec3::Zero(), Vec3::Ones()); }

// Repairs `mesh` and checks that it has one flaw, with this message, and that its remedy names `remedy`.
void expect_flaw(TriangleMesh mesh, const std::string& message, const std::string& remedy) {
  const MeshReport report = repair(mesh);
  ASSERT_EQ(report.flaws.size(), 1U) << (report.flaws.empty() ? "" : report.flaws[1].message);
  EXPECT_EQ(report.flaws[0].message, message);
  EXPECT_NE(report.flaws[0].remedy.find(remedy), std::string::npos) << report.flaws[0].remedy;
}

TEST(MeshCheck, AClosedMeshPassesAsItIs) {
  for (const TriangleMesh& mesh : {box(), test::l_mesh(), test::torus_mesh(1, 0.3, 12, 8)}) {
    TriangleMesh repaired = mesh;
    const MeshReport report = repair(repaired);
    EXPECT_TRUE(report.flaws.empty()) << report.flaws[0].message;
    EXPECT_TRUE(report.repairs.empty()) << report.repairs[0];
    EXPECT_EQ(repaired.positions, mesh.positions);
    EXPECT_EQ(repaired.triangles, mesh.triangles);
  }
}

TEST(MeshCheck, NamesOpenEdges) {
  TriangleMesh mesh = box();
  mesh.triangles.pop_back();  // The triangle that is removed is {1, 7, 5}.
  expect_flaw(mesh, "has 3 open edges, the first from [1, 0, 0] to [1, 0, 1]", "fill the holes");
}

TEST(MeshCheck, NamesTrianglesOfOppositeOrientation) {
  TriangleMesh mesh = box();
  std::swap(mesh.triangles[0][0], mesh.triangles[0][1]);
  expect_flaw(mesh,
              "has 3 edges between triangles that face opposite ways, the first from [0, 0, 0] to [0, 1, 0]",
              "recalculate the normals");
}

TEST(MeshCheck, NamesNonManifoldEdges) {
  TriangleMesh mesh = box();  // A second box is added that shares one edge with this one.
  const TriangleMesh other = test::box_mesh(Vec3(1, 1, 0), Vec3(2, 2, 1));
  for (Triangle t : other.triangles) {
    for (int& v : t) v += 8;
    mesh.triangles.push_back(t);
  }
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  expect_flaw(mesh, "has 1 non-manifold edge, shared by more than two triangles, from [1, 1, 0] to [1, 1, 1]",
              "split the mesh");
}

TEST(MeshCheck, NamesDisconnectedParts) {
  TriangleMesh mesh = box();
  const TriangleMesh other = test::box_mesh(Vec3(3, 0, 0), Vec3(4, 1, 1));
  for (Triangle t : other.triangles) {
    for (int& v : t) v += 8;
    mesh.triangles.push_back(t);
  }
  mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
  expect_flaw(mesh, "falls into 2 parts that are not connected, the second one at [3, 0, 0]",
              "a body of its own");
}

TEST(MeshCheck, RefusesMeshesWithoutVolumeOrTriangles) {
  TriangleMesh flat = box();
  for (Vec3& x : flat.positions) x.y() *= 1e-5;
  EXPECT_TRUE(repair(flat).flaws.empty()) << "thin is not flat";
  TriangleMesh sheet;
  sheet.positions = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
  sheet.triangles = {{0, 1, 2}, {0, 2, 1}};
  expect_flaw(sheet, "encloses no volume (0 m^3 before scaling, 1.41 m across)", "thickness");
  expect_flaw(TriangleMesh{}, "has no triangle", "triangles or polygons");
}

TEST(MeshCheck, RefusesCoordinatesThatAreNotFinite) {
  TriangleMesh mesh = box();
  mesh.positions[3].y() = std::nan("");
  constexpr const char* message = "has 1 vertex with coordinates that are no finite numbers, or above 3.4e38";
  expect_flaw(mesh, message, "export");
  mesh.positions[3].y() = -1e39;
  expect_flaw(mesh, message, "export");
  // Importers repeat a vertex for each of its triangles.
  mesh.positions.push_back(mesh.positions[3]);
  mesh.triangles[0][0] = static_cast<int>(mesh.positions.size()) - 1;
  expect_flaw(mesh, message, "export");
}

TEST(MeshCheck, SplitVerticesAreJoined) {
  // Every triangle has corners of its own, as in STL files. Joining equal positions is no repair to report.
  const TriangleMesh whole = box();
  TriangleMesh soup;
  for (std::size_t t = 0; t < whole.triangles.size(); ++t) {
    const int first = static_cast<int>(soup.positions.size());
    for (std::size_t k = 0; k < 3; ++k) soup.positions.push_back(whole.corner(t, k));
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  TriangleMesh joined = soup;
  MeshReport report = repair(joined);
  EXPECT_TRUE(report.flaws.empty() && report.repairs.empty());
  EXPECT_EQ(joined.positions.size(), 8U);
  // Joining vertices that differ by rounding is reported.
  soup.positions[5] += Vec3(1e-7, 0, -1e-7);
  report = repair(soup);
  EXPECT_TRUE(report.flaws.empty());
  ASSERT_EQ(report.repairs.size(), 1U);
  EXPECT_EQ(report.repairs[0], "1 vertex within 1.7e-06 m of another one was joined to it");
  EXPECT_EQ(soup.positions.size(), 8U);
}

TEST(MeshCheck, TrianglesWithoutAreaAreDropped) {
  TriangleMesh mesh = box();
  mesh.triangles.push_back({3, 3, 5});
  mesh.positions.push_back(mesh.positions[2]);
  mesh.triangles.push_back({2, 8, 4});
  const MeshReport report = repair(mesh);
  EXPECT_TRUE(report.flaws.empty());
  ASSERT_EQ(report.repairs.size(), 1U);
  EXPECT_EQ(report.repairs[0], "2 triangles without area were dropped");
  EXPECT_EQ(mesh.triangles, box().triangles);
  EXPECT_EQ(mesh.positions, box().positions);
}

TEST(MeshCheck, AnInvertedMeshIsTurnedAround) {
  TriangleMesh mesh = box();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    mesh.normals.push_back({});
    mesh.uvs.push_back({Vec2f(0, 0), Vec2f(1, 0), Vec2f(2, 0)});
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  }
  const MeshReport report = repair(mesh);
  EXPECT_TRUE(report.flaws.empty());
  ASSERT_EQ(report.repairs.size(), 1U);
  EXPECT_EQ(report.repairs[0], "all 12 triangles faced inward and were turned around");
  EXPECT_DOUBLE_EQ(mass_properties(mesh).volume, 1);
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_EQ(mesh.uvs[0][1], Vec2f(2, 0)) << "corners keep their own";
}

}  // namespace
}  // namespace duet::mesh_check_test
