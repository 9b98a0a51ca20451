// Tests that damaged and forged mesh files are refused with an error, quickly and in little memory. The
// inputs are findings of tests/fuzz.
#include <ctime>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/geometry/files/mesh_file.h"
#include "sim/geometry/files/tet_mesh_file.h"

namespace duet::hostile_mesh_test {
namespace {

class HostileMesh : public testing::Test {
 protected:
  ScratchFolder scratch;

  // Checks that reading the file throws a FileError with the words, within 1.5 s of processor time.
  template <class Read>
  void expect_refused(const std::string& name, const std::string& bytes, const std::string& words,
                      Read&& read) {
    SCOPED_TRACE(name + ": " + bytes.substr(0, 100));
    io::write_atomically(scratch / name, bytes);
    const std::clock_t start = std::clock();
    try {
      read((scratch / name).string());
      ADD_FAILURE() << "the file was accepted";
    } catch (const FileError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
    EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 1.5);
  }
  void expect_refused(const std::string& name, const std::string& bytes, const std::string& words) {
    expect_refused(name, bytes, words, [](const std::string& path) { read_mesh(path); });
  }
};

// Returns a number as four bytes, little-endian.
std::string four(unsigned long number) {
  std::string bytes;
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(number >> shift & 0xff);
  return bytes;
}

// Returns a .glb file of one chunk with JSON, whose lengths may be wrong.
std::string glb(const std::string& json, unsigned long length, unsigned long chunk) {
  return "glTF" + four(2) + four(length) + four(chunk) + "JSON" + json;
}

TEST_F(HostileMesh, GltfThatNestsDeepIsRefused) {
  const std::string deep = std::string(100000, '[') + std::string(100000, ']');
  expect_refused("deep.gltf", "{\"asset\":{\"version\":\"2.0\"},\"extras\":" + deep + "}",
                 "nests JSON too deep");
  expect_refused("deep.glb", glb(deep, 20 + deep.size(), deep.size()), "nests JSON too deep");
}

// Returns the JSON of a glTF file whose nodes have the given children.
std::string gltf_of_nodes(const std::vector<std::string>& children) {
  std::string nodes;
  for (const std::string& list : children)
    nodes += (nodes.empty() ? "{" : ",{") + (list.empty() ? "" : "\"children\":[" + list + "]") + "}";
  return "{\"asset\":{\"version\":\"2.0\"},\"scenes\":[{\"nodes\":[0]}],\"nodes\":[" + nodes + "]}";
}

// Assimp visits nodes recursively, and makes a node again for each parent that lists it.
TEST_F(HostileMesh, GltfNodesThatAreNoSmallTreeAreRefused) {
  std::vector<std::string> chain, doubled;
  for (int i = 1; i < 20000; ++i) chain.push_back(std::to_string(i));
  chain.emplace_back();
  const std::string deep = gltf_of_nodes(chain);
  expect_refused("deep.gltf", deep, "nests nodes more than 1000 levels deep");
  expect_refused("deep.glb", glb(deep, 20 + deep.size(), deep.size()),
                 "nests nodes more than 1000 levels deep");
  std::string latin = deep;  // bytes that are no UTF-8 do not hide the nodes
  latin.insert(1, "\"extras\":\"\xe9\",");
  expect_refused("latin.gltf", latin, "nests nodes more than 1000 levels deep");
  for (int i = 1; i < 40; ++i) doubled.push_back(std::to_string(i) + "," + std::to_string(i));
  doubled.emplace_back();
  expect_refused("doubled.gltf", gltf_of_nodes(doubled), "makes more than 1e+06 nodes");
  expect_refused("cycle.gltf", gltf_of_nodes({"1", "2", "0"}), "has a node that is below itself");
}

TEST_F(HostileMesh, GlbWithLyingLengthsIsRefused) {
  const std::string json = "{\"asset\":{\"version\":\"2.0\"}}   ";
  expect_refused("short.glb", "glTF" + four(2), "too short");
  expect_refused("length.glb", glb(json, 4000000000, json.size()), "another length than its header says");
  expect_refused("chunk.glb", glb(json, 20 + json.size(), 4000000000), "ends within one of its chunks");
}

TEST_F(HostileMesh, MeditVerticesBeyondAllNodesAreRefused) {
  const std::string nodes = "MeshVersionFormatted 2\nDimension 3\nVertices\n1\n0 0 0 0\nTetrahedra\n1\n";
  for (const char* vertex : {"-2147483648", "-9223372036854775808", "9223372036854775807", "0", "2"})
    expect_refused("tets.mesh", nodes + "1 1 1 " + vertex + " 0\n", "is not among the 1 of the mesh",
                   [](const std::string& path) { read_tet_mesh(path); });
}

// No corner of a face that winds to and fro sees all others.
TEST_F(HostileMesh, PlyFacesOfManyCornersAreRefusedQuickly) {
  constexpr int count = 30000;
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uint uint vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n";
  text += std::to_string(count);
  std::mt19937 random(1);
  for (int i = 0; i < count; ++i) text += " " + std::to_string(random() % 4);
  expect_refused("face.ply", text + "\n", "cannot be cut into a fan of triangles");
}

}  // namespace
}  // namespace duet::hostile_mesh_test
