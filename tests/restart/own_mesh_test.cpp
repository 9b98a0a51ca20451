// Tests that an exported cache moves the user's own model. The cache comes with the user's file, and its
// point i is vertex i of that file, whatever order of vertices, polygons, texture seams and unused vertices
// the file has.
#include "sim/io/export/own_mesh.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <sstream>
#include <tuple>

#include "tests/restart/program.h"
#include "tests/support/text.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/base/types.h"
#include "sim/io/export/own_obj.h"

namespace duet::test::own_mesh_test {
namespace {

// A box of quads. Its vertices are in an order that no reader of meshes would choose, and follow a vertex
// that no face uses. Two more vertices are at the positions of others, as at a texture seam.
constexpr const char* model = R"(# a model
v 9 9 9
v -0.4 0.3 0.2
v 0.4 0.3 0.2
v 0.4 -0.3 0.2
v -0.4 -0.3 0.2
v -0.4 0.3 -0.2
v	0.4 0.3 -0.2
v 0.4 -0.3 -0.2 1.0
v -0.4 -0.3 -0.2
v 0.4 0.3 0.2
v 0.4 0.3 -0.2
vt 0 0
vt 1 1
g sides
usemtl paint
f 9/1 6/1 7/2 8/2
f 5/1 4/1 3/2 2/2
f 9 8 4 5
f 8 7 10 4
g lid
f 11 6 2 10
f 6 9 5 2
)";

std::string scene_text(double far) {
  return fmt::format(R"(title = "Model"
frames = 4
[materials.jelly]
density = 1000
youngs_modulus = 2e5
poisson_ratio = 0.4
[ground]
[[rigid]]
name = "hard"
shape = {{ mesh = "model.obj", scale = 0.5 }}
density = 700
position = [{0}, 1, 0.3]
rotation = {{ axis = [1, 2, 3], degrees = 40 }}
angular_velocity = [1, 2, 3]
[[deformable]]
name = "soft"
shape = {{ mesh = "model.obj", spacing = 0.15 }}
position = [{0}, 2, 5]
rotation = {{ axis = [3, 2, 1], degrees = 70 }}
angular_velocity = [3, 2, 1]
material = "jelly"
[[deformable]]
name = "plain"
shape = {{ mesh = "model.obj", spacing = 0.15 }}
drawn = "tetrahedra"
position = [{0}, 2, 9]
material = "jelly"
)",
                     far);
}

// Returns the points of every frame of a PC2 file.
std::vector<std::vector<Vec3>> read_pc2(const fs::path& path) {
  const std::string bytes = io::read_file(path);
  std::array<std::int32_t, 2> head{};
  std::memcpy(head.data(), bytes.data() + 12, sizeof head);
  std::vector<std::vector<Vec3>> frames;
  for (std::size_t at = 32; at < bytes.size();) {
    frames.emplace_back();
    for (int i = 0; i < head[1]; ++i, at += 12) {
      std::array<float, 3> x{};
      std::memcpy(x.data(), bytes.data() + at, sizeof x);
      frames.back().emplace_back(x[0], x[1], x[2]);
    }
  }
  return frames;
}

// Checks that the points are the vertices of the model, scaled, rotated and translated. It compares the
// distances between all vertices that faces use.
void expect_shape(const std::vector<Vec3>& points, double scale, double tolerance, const std::string& where) {
  const std::vector<Vec3> vertices = io::obj_vertices(model);
  ASSERT_EQ(points.size(), vertices.size()) << where;
  for (std::size_t i = 1; i < points.size(); ++i)
    for (std::size_t k = i + 1; k < points.size(); ++k)
      EXPECT_NEAR((points[i] - points[k]).norm(), scale * (vertices[i] - vertices[k]).norm(), tolerance)
          << where << ", vertices " << i << " and " << k;
}

class OwnMesh : public testing::TestWithParam<double> {};

TEST_P(OwnMesh, PointIOfACacheIsVertexIOfTheFile) {
  const ScratchFolder scratch;
  io::write_atomically(scratch / "model.obj", model);
  io::write_atomically(scratch / "model.toml", scene_text(GetParam()));
  const Finished simulated = run_duet({"sim", "model.toml", "--out", "run", "--quiet"}, scratch.path());
  ASSERT_EQ(simulated.status, 0) << simulated.errors;
  fs::remove(scratch / "model.obj");
  // m: single precision at a few body sizes from the origin that the cache has of its own
  constexpr double rounding = 2e-6;
  for (const std::vector<std::string>& axes : {std::vector<std::string>{}, {"--up", "z", "--scale", "100"}}) {
    std::vector<std::string> words = {"export", "run", "--to", "pc2", "--overwrite", "--quiet"};
    words.insert(words.end(), axes.begin(), axes.end());
    const double scale = axes.empty() ? 1 : 100;
    const Finished exported = run_duet(words, scratch.path());
    ASSERT_EQ(exported.status, 0) << exported.errors;
    const fs::path folder = scratch / "run/export/pc2";
    EXPECT_TRUE(contains(io::read_file(folder / "export.json"), "\"is_own_mesh\": false"))
        << "of the plain body";
    for (const char* mesh : {"hard.obj", "soft.obj"}) EXPECT_EQ(io::read_file(folder / mesh), model) << mesh;
    EXPECT_NE(io::read_file(folder / "plain.obj"), model);

    const auto hard = read_pc2(folder / "hard.pc2"), soft = read_pc2(folder / "soft.pc2");
    ASSERT_EQ(hard.size(), 5U);
    for (std::size_t f = 0; f < hard.size(); ++f)
      expect_shape(hard[f], 0.5 * scale, rounding * scale, fmt::format("rigid, frame {}", f));
    expect_shape(soft.at(0), scale, rounding * scale, "soft, frame 0");
    expect_shape(soft.at(4), scale, 0.1 * scale, "soft, frame 4");
    EXPECT_EQ(soft[4][2], soft[4][9]) << "the seam does not open";
    EXPECT_GT((soft[4][2] - soft[0][2]).norm(), 0.05 * scale) << "it moves";
  }
}

INSTANTIATE_TEST_SUITE_P(NearAndFar, OwnMesh, testing::Values(0.0, 1e5));

// Returns the lines of an OBJ text that begin with the keyword.
std::vector<std::string> lines_of(const std::string& text, const std::string& keyword) {
  std::vector<std::string> found;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with(keyword + " ")) found.push_back(line);
  return found;
}

// An OBJ sequence keeps the user's polygons, texture coordinates, groups and materials, with the indices of a
// file in which other bodies come first.
TEST(OwnMeshFiles, AnObjSequenceKeepsTheUsersPolygons) {
  const ScratchFolder scratch;
  io::write_atomically(scratch / "model.obj", model);
  io::write_atomically(scratch / "model.toml", scene_text(0));
  ASSERT_EQ(run_duet({"sim", "model.toml", "--out", "run", "--quiet"}, scratch.path()).status, 0);
  const Finished exported = run_duet({"export", "run", "--to", "obj", "--quiet"}, scratch.path());
  ASSERT_EQ(exported.status, 0) << exported.errors;
  const std::string text = io::read_file(scratch / "run/export/obj/0004.obj");
  const std::size_t hard = text.find("o hard\n"), soft = text.find("o soft\n");
  ASSERT_LT(text.find("o plain\n"), hard);
  ASSERT_LT(hard, soft);
  ASSERT_NE(soft, std::string::npos);
  const std::string plain_part = text.substr(0, hard), hard_part = text.substr(hard, soft - hard),
                    soft_part = text.substr(soft);
  int vertices = static_cast<int>(lines_of(plain_part, "v").size());
  int uvs = static_cast<int>(lines_of(plain_part, "vt").size());
  for (const auto& [part, scale, tolerance] : {std::tuple(hard_part, 0.5, 1e-7), {soft_part, 1.0, 0.1}}) {
    expect_shape(io::obj_vertices(part), scale, tolerance, "frame 4");
    const std::vector<std::string> faces = lines_of(part, "f");
    ASSERT_EQ(faces.size(), 6U);
    EXPECT_EQ(faces[0], fmt::format("f {}/{} {}/{} {}/{} {}/{}", vertices + 9, uvs + 1, vertices + 6, uvs + 1,
                                    vertices + 7, uvs + 2, vertices + 8, uvs + 2));
    EXPECT_EQ(faces[4],
              fmt::format("f {} {} {} {}", vertices + 11, vertices + 6, vertices + 2, vertices + 10));
    EXPECT_EQ(lines_of(part, "vt"), (std::vector<std::string>{"vt 0 0", "vt 1 1"}));
    EXPECT_EQ(lines_of(part, "g"), (std::vector<std::string>{"g sides", "g lid"}));
    vertices += 11;
    uvs += 2;
  }
  // The tolerance of the rigid body is the rounding of meshes, which are read in single precision. One
  // material of the user's file in two looks becomes two materials.
  EXPECT_EQ(lines_of(hard_part, "usemtl"), std::vector<std::string>{"usemtl paint"});
  EXPECT_EQ(lines_of(soft_part, "usemtl"), std::vector<std::string>{"usemtl paint-2"});
  const std::string materials = io::read_file(scratch / "run/export/obj/materials.mtl");
  for (const char* name : {"newmtl paint\n", "newmtl paint-2\n"})
    EXPECT_TRUE(contains(materials, name)) << name;
}

// Returns the model without its first vertex, which no face uses, and which Blender's importer leaves out.
std::string model_without_loose_vertices() {
  std::istringstream lines(model);
  std::string text;
  for (std::string line; std::getline(lines, line);) {
    if (line == "v 9 9 9") continue;
    if (!line.starts_with("f ")) {
      text += line + '\n';
      continue;
    }
    std::istringstream corners(line.substr(2));
    text += 'f';
    for (std::string corner; corners >> corner;) {
      const std::size_t slash = std::min(corner.find('/'), corner.size());
      text += fmt::format(" {}{}", std::stoi(corner.substr(0, slash)) - 1, corner.substr(slash));
    }
    text += '\n';
  }
  return text;
}

// What the page for users says: Blender imports the model as it suggests, and the modifier Mesh Cache plays
// the run on it.
TEST(OwnMeshFiles, BlenderPlaysTheCacheOnTheModel) {
  const ScratchFolder scratch;
  const auto shell = [&](const std::string& command) {
    Program program({"-c", command}, source_folder(), "/bin/sh");
    return finish(program);
  };
  if (shell("command -v blender").status != 0) GTEST_SKIP() << "blender is not installed";
  io::write_atomically(scratch / "model.obj", model_without_loose_vertices());
  io::write_atomically(scratch / "model.toml", scene_text(0));
  ASSERT_EQ(run_duet({"sim", "model.toml", "--out", "run", "--quiet"}, scratch.path()).status, 0);
  for (const char* format : {"pc2", "obj"})
    ASSERT_EQ(
        run_duet({"export", "run", "--to", format, "--bodies", "soft", "--quiet"}, scratch.path()).status, 0);
  const Finished played =
      shell(fmt::format("blender -b --factory-startup --python-exit-code 1 --python "
                        "tests/restart/blender_cache_check.py -- {0}/model.obj {0}/run/export/pc2/soft.pc2 "
                        "{0}/run/export/obj",
                        scratch.path().string()));
  EXPECT_EQ(played.status, 0) << played.errors;
  const bool compared = std::any_of(played.output.begin(), played.output.end(), [](const std::string& line) {
    return line.starts_with("compared 5 frames of 6 polygons, 1 materials, 1 layer");
  });
  EXPECT_TRUE(compared);
}

std::string no_material(const std::string&) { return {}; }

// Positive indices count in the whole file, negative ones in what comes before them.
TEST(OwnMeshFiles, FacesMayComeBeforeTheirVertices) {
  const io::OwnObj obj("f 1/2 2/1 3/1\no first\nv 0 0 0\nv 1 0 0\nf -2 -1 3\nv 0 1 0\nvt 0 0\nvt 1 1\n",
                       "body", 10, 20, no_material);
  EXPECT_EQ(obj.damaged_faces(), 0);
  io::TextBuilder text;
  obj.add(text, {Vec3::Zero()}, {0, 0, 0});
  EXPECT_EQ(
      text.take(),
      "o body\nv 0 0 0\nv 0 0 0\nv 0 0 0\nvt 0 0\nvt 1 1\nf 11/22 12/21 13/21\no body.first\nf 11 12 13\n");
}

TEST(OwnMeshFiles, IndicesOutOfRangeAreCounted) {
  const io::OwnObj obj(
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/2 3/1\nf 1/1 2/1 3/1\nf 1 2 4\nf -4 1 2\nf 1 2 x\n"
      "f 1 2 99999999999\n",
      "body", 0, 0, no_material);
  EXPECT_EQ(obj.damaged_faces(), 5);
  io::TextBuilder text;
  obj.add(text, {}, {});
  EXPECT_EQ(text.take(), "o body\nvt 0 0\nf 1 2 3\nf 1/1 2/1 3/1\n")
      << "no face has a half of its coordinates";
}

TEST(OwnMeshFiles, IndicesThatCountBackwardsAndFacesOfNothing) {
  const io::OwnObj obj(
      "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf -3//1 -2//1 -1//-1\nf 0 1 2\no next\nv 5 5 5\nf 1 2 "
      "4\n",
      "body", 10, 20, no_material);
  EXPECT_EQ(obj.vertices(), 4);
  EXPECT_EQ(obj.damaged_faces(), 1);
  io::TextBuilder text;
  obj.add(text, {Vec3(1, 2, 3), Vec3::Zero()}, {0, 1, 1, 0});
  EXPECT_EQ(text.take(), "o body\nv 1 2 3\nv 0 0 0\nv 0 0 0\nv 1 2 3\nf 11 12 13\no body.next\nf 11 12 14\n");
}

TEST(OwnMeshFiles, VerticesAreReadInTheirOrder) {
  const std::vector<Vec3> vertices =
      io::obj_vertices("v 1 2 3\nvn 7 7 7\n v\t+4 5e-1 -6 1\nvt 1 1\r\nv 1 2 3\r\nv 1 2");
  ASSERT_EQ(vertices.size(), 3U) << "an incomplete line ends them";
  EXPECT_EQ(vertices[1], Vec3(4, 0.5, -6));
  EXPECT_EQ(vertices[2], vertices[0]);
}

TEST(OwnMeshFiles, AnyLineEndsAndLinesThatGoOn) {
  EXPECT_EQ(io::obj_statements("v 1\r\nv 2\rv 3\nf 1 \\\n2 \\\r\n3\n"), "v 1\nv 2\nv 3\nf 1  2  3\n");
}

TEST(OwnMeshFiles, ARunWithoutFrame0SaysThatItsModelsAreNotFound) {
  const ScratchFolder scratch;
  io::write_atomically(scratch / "model.obj", model);
  io::write_atomically(scratch / "model.toml", scene_text(0));
  ASSERT_EQ(
      run_duet({"sim", "model.toml", "--out", "run", "--quiet", "--frames", "2:3"}, scratch.path()).status,
      0);
  const Finished exported = run_duet({"export", "run", "--to", "pc2"}, scratch.path());
  EXPECT_EQ(exported.status, 0) << exported.errors;
  std::string said;
  for (const std::string& line : exported.output) said += line + '\n';
  EXPECT_TRUE(contains(said + exported.errors, "no frame 0")) << said << exported.errors;
}

TEST(OwnMeshFiles, PointsOfAnotherMeshAreNotMatched) {
  const std::vector<Vec3> positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  EXPECT_EQ(io::match_points({positions[2], positions[0], positions[2]}, positions, 1e-6),
            (std::vector<int>{2, 0, 2}));
  EXPECT_EQ(io::match_points({positions[3] + Vec3(0, 5e-7, 0), Vec3(0.9, 0, 0)}, positions, 1e-6),
            (std::vector<int>{3, 1}))
      << "a loose point follows the nearest one";
  EXPECT_FALSE(io::match_points({positions[3], Vec3(0.9, 0, 0), Vec3(0.8, 0, 0)}, positions, 1e-6));
  EXPECT_FALSE(io::match_points({Vec3::Zero()}, {}, 1e-6));
}

}  // namespace
}  // namespace duet::test::own_mesh_test
