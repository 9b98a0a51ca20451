// Tests of the mesh reader with files of every format, which the tests write themselves so that the content
// is known.
#include "sim/geometry/files/mesh_file.h"

#include <cstdint>
#include <filesystem>

#include "tests/support/meshes.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/geometry/mesh/mesh_check.h"
#include "sim/io/run_directory.h"

namespace duet::mesh_file_test {
namespace {

// The corner tetrahedron of the unit cube, of volume 1/6.
const TriangleMesh tetrahedron = test::tetrahedron(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ());

class MeshFile : public testing::Test {
 protected:
  ScratchFolder scratch;

  std::string write(const std::string& name, const std::string& bytes) {
    io::write_atomically(scratch / name, bytes);
    return (scratch / name).string();
  }
  void expect_tetrahedron(const std::string& name, const std::string& bytes) {
    SCOPED_TRACE(name);
    TriangleMesh mesh = read_mesh(write(name, bytes));
    const MeshReport report = repair(mesh);
    EXPECT_TRUE(report.flaws.empty()) << report.flaws[0].message;
    EXPECT_TRUE(report.repairs.empty()) << report.repairs[0];
    EXPECT_EQ(mesh.positions.size(), 4U);
    EXPECT_EQ(mesh.triangles.size(), 4U);
    EXPECT_NEAR(mass_properties(mesh).volume, 1.0 / 6, 1e-7);
  }
  void expect_error(const std::string& path, const std::string& message) {
    try {
      read_mesh(path);
      ADD_FAILURE() << path << " was accepted";
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find(message), std::string::npos) << error.what();
    }
  }
};

// Appends the bytes of `value`, in reverse order if `swapped`.
template <class Value>
void append(std::string& bytes, Value value, bool swapped) {
  std::string raw(reinterpret_cast<const char*>(&value), sizeof value);
  bytes += swapped ? std::string(raw.rbegin(), raw.rend()) : raw;
}

// Returns a PLY file of the tetrahedron with a color, an empty element and mixed types, which a reader has to
// skip or convert.
std::string ply(const std::string& format) {
  std::string bytes = "ply\nformat " + format +
                      " 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\n"
                      "property double z\nproperty uchar red\nelement face 4\nproperty list uchar int "
                      "vertex_indices\nelement edge 0\nproperty int vertex1\nend_header\n";
  for (const Vec3& x : tetrahedron.positions) {
    if (format == "ascii") {
      bytes += fmt::format("{} {} {} 7\n", x.x(), x.y(), x.z());
      continue;
    }
    const bool swapped = format == "binary_big_endian";
    append(bytes, static_cast<float>(x.x()), swapped);
    append(bytes, static_cast<float>(x.y()), swapped);
    append(bytes, x.z(), swapped);
    bytes += '\x07';
  }
  for (const Triangle& t : tetrahedron.triangles) {
    if (format == "ascii") {
      bytes += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
      continue;
    }
    bytes += '\x03';
    for (const int v : t) append(bytes, v, format == "binary_big_endian");
  }
  return bytes;
}

TEST_F(MeshFile, EveryFormatIsRead) {
  std::string obj = "# by hand\no first\n", stl = "solid t\n";
  for (const Vec3& x : tetrahedron.positions) obj += fmt::format("v {} {} {}\n", x.x(), x.y(), x.z());
  for (std::size_t t = 0; t < 4; ++t) {
    const Triangle& v = tetrahedron.triangles[t];
    if (t == 2) obj += "o second\n";
    obj += fmt::format("f {} {} {}\n", v[0] + 1, v[1] + 1, v[2] + 1);
    stl += "facet normal 0 0 0\nouter loop\n";
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& x = tetrahedron.corner(t, k);
      stl += fmt::format("vertex {} {} {}\n", x.x(), x.y(), x.z());
    }
    stl += "endloop\nendfacet\n";
  }
  expect_tetrahedron("t.obj", obj);
  expect_tetrahedron("t.STL", stl + "endsolid t\n");
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"})
    expect_tetrahedron("t.ply", ply(format));
  // The buffer holds 4 positions of 3 floats and 12 indices of 16 bits. The node scales x by 1/2 and y by 2,
  // which keeps the volume.
  expect_tetrahedron("t.gltf", R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
"nodes": [{"mesh": 0, "scale": [0.5, 2, 1]}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
"buffers": [{"byteLength": 72, "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAACAAEAAAABAAMAAAADAAIAAQACAAMA"}],
"bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
{"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"}]})");
}

TEST_F(MeshFile, ReadsPolygonsNormalsAndTextureCoordinates) {
  // This is a prism over a concave outline of area 3, given as polygons.
  const std::string prism =
      "v 0 0 1\nv 2 0 1\nv 2 1 1\nv 1 1 1\nv 1 2 1\nv 0 2 1\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv "
      "0 2 0\n"
      "f 1 2 3 4 5 6\nf 12 11 10 9 8 7\nf 1 7 8 2\nf 2 8 9 3\nf 3 9 10 4\nf 4 10 11 5\nf 5 11 12 6\nf 6 12 7 "
      "1\n";
  TriangleMesh mesh = read_mesh(write("l.obj", prism));
  EXPECT_TRUE(repair(mesh).flaws.empty());
  EXPECT_NEAR(mass_properties(mesh).volume, 3, 1e-6);
  EXPECT_TRUE(mesh.normals.empty() && mesh.uvs.empty());

  const TriangleMesh dressed = read_mesh(write("dressed.obj",
                                               "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.25 0.75\nvn 0 0.6 0.8\n"
                                               "f 1/1/1 2/1/1 3/1/1\n"));
  ASSERT_EQ(dressed.normals.size(), 1U);
  ASSERT_EQ(dressed.uvs.size(), 1U);
  EXPECT_TRUE(dressed.normals[0][2].isApprox(Vec3f(0, 0.6F, 0.8F)));
  EXPECT_TRUE(dressed.uvs[0][1].isApprox(Vec2f(0.25F, 0.75F)));
}

// Numbers may begin with their decimal point, with and without a sign, as many programs write them.
TEST_F(MeshFile, NumbersMayBeginWithAPoint) {
  const TriangleMesh mesh = read_mesh(write("points.obj",
                                            "v -.5 .25\t-.125\nv +.5 -0.5 1.\r\nv 1.5e-1 .75e1 -.0625\n"
                                            "vt .25 .5\nvn 0 .6 -.8\nf 1/1/1 2/1/1 3/1/1\n"));
  ASSERT_EQ(mesh.positions.size(), 3U);
  ASSERT_EQ(mesh.triangles.size(), 1U);
  ASSERT_EQ(mesh.normals.size(), 1U);
  EXPECT_EQ(mesh.corner(0, 0), Vec3(-0.5, 0.25, -0.125));
  EXPECT_EQ(mesh.corner(0, 1), Vec3(0.5, -0.5, 1));
  EXPECT_LT((mesh.corner(0, 2) - Vec3(0.15, 7.5, -0.0625)).norm(), 1e-6);
  EXPECT_EQ(mesh.uvs[0][1], Vec2f(0.25F, 0.5F));
  EXPECT_TRUE(mesh.normals[0][2].isApprox(Vec3f(0, 0.6F, -0.8F)));
}

TEST_F(MeshFile, WhatCannotBeReadIsNamed) {
  expect_error((scratch / "none.obj").string(), "there is no such file");
  expect_error(write("mesh.fbx", "x"), ".obj .ply .stl .gltf .glb");
  expect_error(scratch.path().string(), "cannot be read");
  expect_error(write("bad.gltf", "{"), "bad.gltf");
  expect_error(write("empty.stl", ""), "empty.stl");
  expect_error(write("bad.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty flo"),
               "the header has no end");
  expect_error(write("type.ply", "ply\nformat ascii 1.0\nelement vertex 4\nproperty flo x\nend_header\n"),
               "line 4");
}

// A byte order mark would hide the first vertex.
TEST_F(MeshFile, TextMayBeginWithAByteOrderMark) {
  const std::string text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
  expect_tetrahedron("mark.obj", "\xef\xbb\xbf" + text);
  expect_tetrahedron("mark_and_point.obj", "\xef\xbb\xbf#\n" + text + "vt .5 .5\n");
  expect_tetrahedron("mark.ply", "\xef\xbb\xbf" + ply("ascii"));
  expect_error(write("mark.gltf", "\xef\xbb\xbf{}"), "begins with a byte order mark");
}

TEST_F(MeshFile, FaultyFacesOfObjFilesAreNamedWithTheirLine) {
  const std::string good = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n";
  expect_error(write("high.obj", good + "f 1 2 9\n"),
               "line 7: a face has the vertex 9, and the file has 3 vertices");
  expect_error(write("low.obj", good + "f 1 2 -4\n"),
               "line 7: a face has the vertex -4, and 3 vertices stand before");
  expect_error(write("zero.obj", good + "f 1 2 0\n"),
               "line 7: a face has the vertex 0, and they are counted from 1");
  expect_error(write("joined.obj", good + "f 1 \\\n2 7\nf 1 2\n"), "line 7: a face has the vertex 7");
  expect_error(write("two.obj", good + "f 1 2\n"), "line 7: a face has 2 corners, and needs 3");
}

// The standard asks for percent-encoded names; Blender writes "my%20model.bin" for `my model.bin`.
TEST_F(MeshFile, GltfBuffersAreFoundByTheirEncodedNames) {
  std::string buffer;
  for (const Vec3& x : tetrahedron.positions)
    for (Eigen::Index k = 0; k < 3; ++k) append(buffer, static_cast<float>(x[k]), false);
  for (const Triangle& t : tetrahedron.triangles)
    for (const int v : t) append(buffer, static_cast<std::uint16_t>(v), false);
  const auto gltf = [](const std::string& uri) {
    return R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
"buffers": [{"byteLength": 72, "uri": ")" +
           uri +
           R"("}], "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
{"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"}]})";
  };
  write("my b\u00fcf%.bin", buffer);
  expect_tetrahedron("encoded.gltf", gltf("my%20b%c3%BCf%25.bin"));
  expect_tetrahedron("plain.gltf", gltf("my b\u00fcf%.bin"));
  std::filesystem::create_directory(scratch / "a%20b");  // the folder's own name is no URI
  expect_tetrahedron("a%20b/inside.gltf", gltf("../my%20b%c3%bcf%.bin"));
  expect_error(write("none.gltf", gltf("none%20.bin")), "none");
  write("taken%20.bin", buffer);  // as it is written, and so it is found
  expect_tetrahedron("taken.gltf", gltf("taken%20.bin"));
}

TEST_F(MeshFile, PlyIndicesAndLengthsOfListsAreWhole) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list float float vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_EQ(read_mesh(write("whole.ply", head + "3.0 0 1 2e0\n")).triangles.size(), 1U);
  expect_error(write("index.ply", head + "3 0 1.5 2\n"), "a face has the vertex 1.5 of 3");
  expect_error(write("length.ply", head + "2.5 0 1 2\n"), "a list has an impossible length");
}

// A PLY file that is cut off is an error. One with a changed byte is an error or a mesh whose indices are in
// range, and never a crash.
TEST_F(MeshFile, DamagedPlyIsAnErrorOrASoundMesh) {
  std::mt19937 random(29);
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const std::string good = ply(format);
    const std::size_t needed = good.find_last_not_of("\n");
    int errors = 0;
    for (std::size_t size = 0; size < needed; ++size) try {
        read_mesh(write("cut.ply", good.substr(0, size)));
      } catch (const FileError&) {
        ++errors;
      }
    EXPECT_EQ(errors, static_cast<int>(needed)) << format;
    for (int i = 0; i < 300; ++i) {
      std::string bad = good;
      bad[random() % bad.size()] = static_cast<char>(random() % 256);
      try {
        const TriangleMesh mesh = read_mesh(write("changed.ply", bad));
        for (const Triangle& t : mesh.triangles)
          for (const int v : t) EXPECT_LT(static_cast<std::size_t>(v), mesh.positions.size());
      } catch (const FileError&) {
      }
    }
  }
}

}  // namespace
}  // namespace duet::mesh_file_test
