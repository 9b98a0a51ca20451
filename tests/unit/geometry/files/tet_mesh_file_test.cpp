#include "sim/geometry/files/tet_mesh_file.h"

#include <algorithm>
#include <fstream>

#include "tests/support/full.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/base/scratch_folder.h"
#include "sim/geometry/mesh/tet_mesh_check.h"
#include "sim/geometry/meshing/tetrahedralizer.h"

namespace duet::tet_mesh_file_test {
namespace {

TetMesh read_text(const std::string& name, const std::string& text) {
  const ScratchFolder folder;
  std::ofstream(folder / name) << text;
  return read_tet_mesh((folder / name).string());
}

void expect_refused(const std::string& name, const std::string& text, const std::string& message) {
  try {
    read_text(name, text);
    ADD_FAILURE() << "accepted: " << text;
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
  }
}

// Two tetrahedra that share a face, in the format of Medit, with marks and boundary triangles that the reader
// skips.
const std::string two_tets_medit = R"(MeshVersionFormatted 1
# written by hand
Dimension
3
Vertices
5
0 0 0 7
1 0 0 7
0 1 0 7
0 0 1 7
1 1 1 7
Triangles
1
1 2 3 0
Tetrahedra
2
1 2 3 4 0
2 3 4 5 0
End
)";

// The two tetrahedra of `two_tets_medit` in version 2.2 of the format of Gmsh, with node numbers that have
// gaps.
const std::string two_tets_gmsh_2 = R"($MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
5
10 0 0 0
20 1 0 0
30 0 1 0
40 0 0 1
50 1 1 1
$EndNodes
$Elements
3
1 2 2 0 1 10 20 30
2 4 2 0 1 10 20 30 40
3 4 2 0 1 20 30 40 50
$EndElements
)";

// The two tetrahedra of `two_tets_medit` in version 4.1 of the format of Gmsh, with nodes in two blocks, one
// of them with parameters.
const std::string two_tets_gmsh_4 = R"($MeshFormat
4.1 0 8
$EndMeshFormat
$Entities
0 0 0 1
1 0 0 0 1 1 1 0 0
$EndEntities
$Nodes
2 5 10 50
2 1 1 2
10
20
0 0 0 0.5 0.5
1 0 0 0.25 0.25
3 1 0 3
30
40
50
0 1 0
0 0 1
1 1 1
$EndNodes
$Elements
2 3 1 3
2 1 2 1
1 10 20 30
3 1 4 2
2 10 20 30 40
3 20 30 40 50
$EndElements
)";

TEST(TetMeshFile, ReadsWhatOtherProgramsWrite) {
  // The second text begins with a byte order mark.
  for (const TetMesh& mesh :
       {read_text("a.mesh", two_tets_medit), read_text("b.mesh", "\xef\xbb\xbf" + two_tets_medit),
        read_text("a.msh", two_tets_gmsh_2), read_text("b.msh", two_tets_gmsh_4)}) {
    EXPECT_EQ(mesh.nodes, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}}));
    EXPECT_EQ(mesh.tets, (std::vector<Tet>{{0, 1, 2, 3}, {1, 2, 3, 4}}));
  }
}

// Line ends are blanks in Medit's format, and in Gmsh's for all elements whose numbers of nodes are known.
TEST(TetMeshFile, ItemsMayShareLinesAndTakeSeveral) {
  std::string medit = two_tets_medit.substr(two_tets_medit.find("Dimension"));
  std::string gmsh_2 = two_tets_gmsh_2, gmsh_4 = two_tets_gmsh_4;
  for (std::string* text : {&medit, &gmsh_2, &gmsh_4}) std::replace(text->begin(), text->end(), '\n', ' ');
  std::string broken = two_tets_medit.substr(two_tets_medit.find("Dimension"));
  std::replace(broken.begin(), broken.end(), ' ', '\n');
  for (const TetMesh& mesh : {read_text("a.mesh", medit), read_text("b.mesh", broken),
                              read_text("a.msh", gmsh_2), read_text("b.msh", gmsh_4)}) {
    EXPECT_EQ(mesh.nodes, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}}));
    EXPECT_EQ(mesh.tets, (std::vector<Tet>{{0, 1, 2, 3}, {1, 2, 3, 4}}));
  }
}

TEST(TetMeshFile, MeditIsReadWithoutReferenceNumbers) {
  const TetMesh mesh =
      read_text("a.mesh",
                "MeshVersionFormatted 2\nDimension 3\nVertices 5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
                "1 1 1\nTetrahedra 2\n1 2 3 4\n2 3 4 5\nEnd\n");
  EXPECT_EQ(mesh.nodes, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}}));
  EXPECT_EQ(mesh.tets, (std::vector<Tet>{{0, 1, 2, 3}, {1, 2, 3, 4}}));
}

TEST(TetMeshFile, MeditKeepsEveryBit) {
  const TetMesh mesh = tetrahedralize(LevelSet::sphere(0.3), 0.1);
  const TetMesh again = read_text("ball.mesh", medit_text(mesh));
  EXPECT_EQ(again.nodes, mesh.nodes);
  EXPECT_EQ(again.tets, mesh.tets);
}

TEST(TetMeshFile, VtkHasAllCells) {
  const std::string text = vtk_text({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1.5}}, {{0, 1, 2, 3}}});
  EXPECT_NE(text.find("POINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1.5\n"), std::string::npos) << text;
  EXPECT_NE(text.find("CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n"), std::string::npos) << text;
}

std::string replaced(std::string text, const std::string& part, const std::string& by) {
  return text.replace(text.find(part), part.size(), by);
}

TEST(TetMeshFile, DamagedFilesAreRefusedWithTheirLine) {
  expect_refused("a.mesh", replaced(two_tets_medit, "2 3 4 5 0", "2 3 4 6 0"), "line 18: vertex 6 is not");
  expect_refused("a.mesh", replaced(two_tets_medit, "1 2 3 4 0", "0 2 3 4 0"), "line 17: vertex 0 is not");
  expect_refused("a.mesh", replaced(two_tets_medit, "0 1 0 7", "0 1e 0 7"), "line 9: expected a coordinate");
  expect_refused("a.mesh", replaced(two_tets_medit, "0 1 0 7", "0 nan 0 7"),
                 "line 9: a coordinate is not finite");
  expect_refused("a.mesh", replaced(two_tets_medit, "\n5\n", "\n500000\n"), "has no room for");
  expect_refused("a.mesh", replaced(two_tets_medit, "Dimension\n3", "Dimension\n2"),
                 "the dimension is not 3");
  expect_refused("a.mesh", replaced(two_tets_medit, "0 1 0 7", "0 1 0"),
                 "line 12: expected a reference number, found `Triangles`");
  expect_refused("a.mesh", replaced(two_tets_medit, "0 1 0 7", "0 1 0 7 8"), "more numbers follow");
  expect_refused("a.mesh", "", "has no tetrahedron");
  expect_refused("a.msh", replaced(two_tets_gmsh_2, "20 30 40 50", "20 30 40 60"), "there is no node 60");
  expect_refused("a.msh", replaced(two_tets_gmsh_2, "2.2 0 8", "2.2 1 8"), "binary");
  expect_refused("a.msh", replaced(two_tets_gmsh_2, "2.2 0 8", "4 0 8"), "version 4 of the format");
  expect_refused("a.msh", "hello", "expected $MeshFormat, found `hello`");
  expect_refused("a.obj", "", "known by its ending");
  EXPECT_THROW(read_tet_mesh("/nowhere/a.mesh"), FileError);
}

// Whichever byte of a file is damaged, the reader throws a FileError or returns a mesh whose indices are in
// range.
TEST(TetMeshFile, NoDamageCrashesTheReader) {
  test::Cases cases(5);
  for (const auto& [name, text] : {std::pair("a.mesh", two_tets_medit), std::pair("a.msh", two_tets_gmsh_2),
                                   std::pair("b.msh", two_tets_gmsh_4)})
    for (std::size_t i = 0; i < text.size(); ++i)
      for (const char c : {'9', '-', ' ', 'x'}) {
        if (!cases.takes()) continue;
        std::string damaged = text;
        damaged[i] = c;
        try {
          for (const TetMesh mesh = read_text(name, damaged); const Tet& tet : mesh.tets)
            for (const int node : tet) ASSERT_LT(static_cast<std::size_t>(node), mesh.nodes.size());
        } catch (const FileError&) {
        }
      }
}

TEST(TetMeshCheck, RepairsWhatIsSafeAndNamesTheRest) {
  TetMesh mesh = read_text("a.mesh", two_tets_medit);
  EXPECT_TRUE(repair(mesh).repairs.empty());

  std::swap(mesh.tets[1][0], mesh.tets[1][1]);
  mesh.nodes.emplace_back(9, 9, 9);
  const MeshReport repaired = repair(mesh);
  EXPECT_TRUE(repaired.flaws.empty());
  ASSERT_EQ(repaired.repairs.size(), 2U);
  EXPECT_EQ(repaired.repairs[0], "1 node that no tetrahedron uses was dropped");
  EXPECT_EQ(repaired.repairs[1], "1 tetrahedron of negative volume was turned around");
  EXPECT_NEAR(volume(mesh), 1.0 / 6 + 1.0 / 3, 1e-15);

  TetMesh flat = mesh;
  flat.nodes[0] = (flat.nodes[1] + flat.nodes[2] + flat.nodes[3]) / 3;
  ASSERT_EQ(repair(flat).flaws.size(), 1U);
  EXPECT_NE(repair(flat).flaws[0].message.find("1 tetrahedron without volume"), std::string::npos);

  TetMesh doubled = mesh;
  doubled.tets.push_back(doubled.tets[0]);
  doubled.tets.push_back(doubled.tets[0]);
  // These are the faces of the first tetrahedron; the second has one of them as well.
  EXPECT_TRUE(repair(doubled).flaws.at(0).message.starts_with(
      "has 4 faces that more than two tetrahedra share, the first at"))
      << repair(doubled).flaws.at(0).message;

  TetMesh apart = mesh;
  for (int i = 0; i < 4; ++i) apart.nodes.push_back(mesh.nodes[static_cast<std::size_t>(i)] + Vec3(5, 0, 0));
  apart.tets.push_back({5, 6, 7, 8});
  EXPECT_NE(repair(apart).flaws.at(0).message.find("falls into 2 parts"), std::string::npos);
}

}  // namespace
}  // namespace duet::tet_mesh_file_test
