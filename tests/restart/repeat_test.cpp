// Tests that a run can be repeated from its folder, elsewhere and without the files that it was made from,
// and that pictures of another look or size go to a folder of their own.
#include "tests/restart/program.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"

namespace duet::test::repeat_test {
namespace {

// A scene with comments that names a mesh in each of the possible ways: for a rigid body, for tetrahedra and
// for a skin, all from a folder beside its own.
constexpr const char* scene_text = R"(# Kept as written.
title = "Own meshes"     # also this
frames = 3
[materials.jelly]
density = 1000
youngs_modulus = 1e5
poisson_ratio = 0.4
[ground]
[[rigid]]
name = "block"
shape = { mesh = "../meshes/block.obj" }
density = 700
position = [0, 1, 0]
[[deformable]]
name = "soft"
shape = { mesh = "../meshes/block.obj", spacing = 0.15 }
position = [2, 1, 0]
material = "jelly"
[[deformable]]
name = "dressed"
shape = { mesh = "../meshes/block.obj", spacing = 0.2 }
skin = { mesh = "../meshes/skin.gltf" }
position = [4, 1, 0]
material = "jelly"
[render]
width = 64
height = 36
)";

constexpr const char* block = R"(v -0.4 -0.3 -0.2
v 0.4 -0.3 -0.2
v 0.4 0.3 -0.2
v -0.4 0.3 -0.2
v -0.4 -0.3 0.2
v 0.4 -0.3 0.2
v 0.4 0.3 0.2
v -0.4 0.3 0.2
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 2 3 7 6
f 3 4 8 7
f 4 1 5 8
)";

// A tetrahedron whose buffer is a separate file, named as the standard asks: percent-encoded.
constexpr const char* skin =
    R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],
"buffers":[{"uri":"data/own%20skin.bin","byteLength":72}],
"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":24}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[-0.2,-0.2,-0.2],"max":[0.2,0.2,0.2]},
{"bufferView":1,"componentType":5123,"count":12,"type":"SCALAR"}]})";

std::string skin_buffer() {
  const float corners[] = {-.2F, -.2F, -.2F, .2F, .2F, -.2F, .2F, -.2F, .2F, -.2F, .2F, .2F};
  const std::uint16_t triangles[] = {0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2};
  return std::string(reinterpret_cast<const char*>(corners), sizeof corners) +
         std::string(reinterpret_cast<const char*>(triangles), sizeof triangles);
}

class Repeat : public testing::Test {
 protected:
  ScratchFolder scratch;

  void SetUp() override {
    write("scenes/own.toml", scene_text);
    write("meshes/block.obj", block);
    write("meshes/skin.gltf", skin);
    write("meshes/data/own skin.bin", skin_buffer());
  }
  void write(const std::string& name, const std::string& bytes) const {
    io::create_folder((scratch / name).parent_path());
    io::write_atomically(scratch / name, bytes);
  }
  Finished duet(std::vector<std::string> words) const {
    words.emplace_back("--quiet");
    const Finished finished = run_duet(words, scratch.path());
    EXPECT_EQ(finished.status, 0) << finished.errors;
    return finished;
  }
  // Returns the hashes of the states, without the times that the lines also have.
  std::vector<std::string> hashes(const std::string& run) const {
    std::vector<std::string> found;
    const std::string text = io::read_file(scratch / run / "stats.jsonl");
    for (std::size_t at = text.find("\"hash\""); at != std::string::npos; at = text.find("\"hash\"", at + 1))
      found.push_back(text.substr(at, 27));
    return found;
  }
};

TEST_F(Repeat, ElsewhereWithoutTheFilesToTheSameBits) {
  duet({"sim", "scenes/own.toml", "--set", "rigid.block.velocity=[1,0,0]", "--without", "push_out",
        "--accuracy", "draft", "--out", "first"});
  EXPECT_EQ(io::read_file(scratch / "first/source/own.toml"), scene_text);
  fs::create_directory(scratch / "moved");
  fs::rename(scratch / "first", scratch / "moved/first");
  fs::remove_all(scratch / "scenes");
  fs::remove_all(scratch / "meshes");

  duet({"sim", "moved/first", "--out", "second"});
  duet({"sim", "second", "--out", "third"});
  EXPECT_EQ(hashes("moved/first").size(), 4U);
  EXPECT_EQ(hashes("second"), hashes("moved/first"));
  EXPECT_EQ(hashes("third"), hashes("moved/first"));
  for (const char* run : {"moved/first", "second", "third"})
    EXPECT_EQ(run_duet({"verify", run}, scratch.path()).status, 0) << run;
}

TEST_F(Repeat, TheFolderIsTheRunsOwnUnlessAnotherIsGiven) {
  duet({"sim", "scenes/own.toml", "--frames", "1", "--out", "run"});
  const Finished refused = run_duet({"sim", "run"}, scratch.path());
  EXPECT_EQ(refused.status, 2);
  EXPECT_TRUE(contains(refused.errors, "--resume")) << refused.errors;
  duet({"sim", "run", "--resume"});
  EXPECT_EQ(hashes("run").size(), 4U);
  duet({"sim", "scenes/own.toml", "--out", "whole"});
  EXPECT_EQ(hashes("run"), hashes("whole"));
  duet({"sim", "run", "--overwrite", "--set", "fps=30"});
  EXPECT_NE(hashes("run"), hashes("whole"));
  duet({"sim", "run", "--out", "again"});
  EXPECT_EQ(hashes("again"), hashes("run")) << "the changes of the command line are kept";
}

TEST_F(Repeat, DamagedSourcesAreRefused) {
  duet({"sim", "scenes/own.toml", "--frames", "1", "--out", "run"});
  write("run/source/source.json",
        "{\"scene\":\"../../scenes/own.toml\",\"set\":[],\"without\":[],\"files\":{}}");
  fs::remove(scratch / "run/journal.jsonl");
  const Finished outside = run_duet({"check", "run"}, scratch.path());
  EXPECT_EQ(outside.status, 4);
  EXPECT_TRUE(contains(outside.errors, "not in the folder")) << outside.errors;
  fs::remove(scratch / "run/source/source.json");
  const Finished missing = run_duet({"check", "run"}, scratch.path());
  EXPECT_EQ(missing.status, 4);
  EXPECT_TRUE(contains(missing.errors, "no copy of its scene")) << missing.errors;
}

TEST_F(Repeat, ADamagedMeshIsRefused) {
  duet({"sim", "scenes/own.toml", "--frames", "1", "--out", "run"});
  fs::path copy;
  for (const auto& entry : fs::recursive_directory_iterator(scratch / "run/source"))
    if (entry.path().filename() == "block.obj") copy = entry.path();
  std::string bytes = io::read_file(copy);
  bytes[bytes.find("0.3")] = '1';
  io::write_atomically(copy, bytes);
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"sim", "run", "--out", "again"}, {"export", "run", "--to", "pc2"}}) {
    const Finished refused = run_duet(words, scratch.path());
    EXPECT_EQ(refused.status, 4) << words[0];
    EXPECT_TRUE(contains(refused.errors, "block.obj") && contains(refused.errors, "damaged"))
        << refused.errors;
  }
  EXPECT_FALSE(fs::exists(scratch / "again")) << "nothing was begun";
}

// Exports replace only exports, also where an export is a single file.
TEST_F(Repeat, AnExportReplacesNoOtherFile) {
  duet({"sim", "scenes/own.toml", "--frames", "1", "--out", "run"});
  for (const char* target : {"scenes/own.toml", "run/manifest.json", "run/stats.jsonl", "/dev/null"}) {
    const Finished refused =
        run_duet({"export", "run", "--to", "glb", "--overwrite", "--out", target}, scratch.path());
    EXPECT_EQ(refused.status, 2) << target;
    EXPECT_TRUE(contains(refused.errors, "no export wrote") ||
                contains(refused.errors, "no file that an export wrote"))
        << refused.errors;
  }
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_EQ(io::read_file(scratch / "scenes/own.toml"), scene_text);
  for (int again = 0; again < 2; ++again)
    duet({"export", "run", "--to", "glb", "--overwrite", "--out", "run.glb"});
}

TEST_F(Repeat, PicturesGoToAFolderOfTheirOwn) {
  duet({"run", "scenes/own.toml", "--frames", "2", "--out", "run"});
  const std::string before = io::read_file(scratch / "run/image/0001.png");
  const std::vector<std::string> preview = {"render", "run", "--out", "preview", "--set", "render.width=32"};
  duet(preview);
  EXPECT_EQ(io::read_file(scratch / "run/image/0001.png"), before);
  const std::string picture = io::read_file(scratch / "preview/image/0001.png");
  EXPECT_NE(picture, before);

  // Only pictures that are missing, cut off or of another size are drawn again.
  std::vector<std::string> again = preview;
  again.emplace_back("--skip-existing");
  write("preview/image/0000.png", before);
  write("preview/image/0002.png", picture.substr(0, picture.size() / 2));
  std::string flipped = picture;
  flipped[flipped.size() / 2] ^= 1;
  write("preview/image/0001.png", flipped);
  EXPECT_TRUE(contains(duet(again).last_line(), "3 pictures")) << duet(again).last_line();
  EXPECT_TRUE(contains(duet(again).last_line(), "0 pictures in preview/image (3 were there)"));
  EXPECT_EQ(run_duet({"verify", "run"}, scratch.path()).status, 0);
}

}  // namespace
}  // namespace duet::test::repeat_test
