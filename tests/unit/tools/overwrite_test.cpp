// Tests that only --overwrite removes frames that somebody may want.
#include <algorithm>
#include <csignal>
#include <map>

#include "tests/restart/program.h"
#include "tests/support/places.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"

namespace duet::test::overwrite_test {
namespace {

class Overwrite : public testing::Test {
 protected:
  ScratchFolder scratch;
  io::RunDirectory run{scratch / "run"};

  Finished simulate(const std::vector<std::string>& more) {
    std::vector<std::string> words = {"sim", tiny, "--out", "run", "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    return run_duet(words, scratch.path());
  }
  void simulate_to(const char* frame) {
    const Finished finished = simulate({"--frames", frame});
    ASSERT_EQ(finished.status, 0) << finished.errors;
  }
  // Returns the path and content of every file in the run directory.
  std::map<fs::path, std::string> all_files() const {
    std::map<fs::path, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(run.root))
      if (entry.is_regular_file()) files[entry.path()] = io::read_file(entry.path());
    return files;
  }
  void damage(const fs::path& path) const {
    std::string bytes = io::read_file(path);
    bytes[bytes.size() / 2] ^= 1;
    io::write_atomically(path, bytes);
  }
  // Checks that the run is refused with this exit status and a message of one line with these words, and that
  // its folder does not change.
  void expect_refused(const std::vector<std::string>& more, int status,
                      const std::vector<std::string>& said) {
    const auto before = all_files();
    const Finished refused = simulate(more);
    EXPECT_EQ(refused.status, status);
    for (const std::string& part : said) EXPECT_TRUE(contains(refused.errors, part)) << refused.errors;
    EXPECT_EQ(std::count(refused.errors.begin(), refused.errors.end(), '\n'), 1) << refused.errors;
    EXPECT_TRUE(all_files() == before) << "a file of the run was changed";
  }
};

TEST_F(Overwrite, AFolderThatHoldsARunIsRefusedWithoutIt) {
  simulate_to("4");
  expect_refused({"--frames", "2"}, 2,
                 {"run: the folder holds 5 frames (0 to 4)", "--resume", "--overwrite", "--out"});
  expect_refused({"--frames", "2", "--stats-only"}, 2, {"5 frames (0 to 4)"});
  const Finished replaced = simulate({"--frames", "2", "--overwrite"});
  EXPECT_EQ(replaced.status, 0) << replaced.errors;
  EXPECT_TRUE(fs::exists(run.mesh(2)));
  EXPECT_FALSE(fs::exists(run.mesh(3)));
}

TEST_F(Overwrite, WhateverOfARunIsLeftIsKept) {
  simulate_to("4");
  fs::remove_all(run.root / "mesh");
  expect_refused({}, 2, {"5 frames (0 to 4)"});
  fs::remove(run.stats());
  expect_refused({}, 2, {"5 frames (0 to 4)"});
  fs::remove_all(run.root / "levelset");
  fs::remove_all(run.root / "values");
  expect_refused({}, 2, {"2 frames (3 to 4)"});
  fs::remove(run.checkpoint() / "0003.bin");
  expect_refused({}, 2, {"1 frame (4)"});
  fs::remove_all(run.checkpoint());
  io::write_atomically(run.root / "tiny.mp4", "a video");
  expect_refused({}, 2, {"a video"});
  fs::remove(run.root / "tiny.mp4");
  EXPECT_EQ(simulate({"--frames", "1"}).status, 0) << "a description alone is no run";
}

TEST_F(Overwrite, AnEmptyFolderNeedsNone) {
  fs::create_directory(run.root);
  simulate_to("1");
  EXPECT_TRUE(fs::exists(run.mesh(1)));
}

TEST_F(Overwrite, ResumeWithoutAWholeCheckpointKeepsEverything) {
  simulate_to("4");
  damage(run.checkpoint() / "0003.bin");
  damage(run.checkpoint() / "0004.bin");
  expect_refused({"--resume"}, 4,
                 {"0004.bin is damaged", "0003.bin is damaged", "5 frames (0 to 4)", "--overwrite"});
  fs::remove(run.checkpoint() / "0003.bin");
  fs::remove(run.checkpoint() / "0004.bin");
  expect_refused({"--resume"}, 4, {"checkpoint holds no checkpoint", "--overwrite"});
  fs::remove_all(run.checkpoint());
  expect_refused({"--resume"}, 4, {"checkpoint holds no checkpoint", "--overwrite"});
  io::write_atomically(run.checkpoint(), "no folder");
  expect_refused({"--resume"}, 4, {"checkpoint: cannot read the folder: Not a directory"});
  const Finished replaced = simulate({"--frames", "2", "--overwrite"});
  EXPECT_EQ(replaced.status, 4) << "a file that is not of a run stands there";
  EXPECT_EQ(io::read_file(run.checkpoint()), "no folder");
}

// The program was killed while it wrote the files of frame 0. There is nothing to resume, so the run starts.
TEST_F(Overwrite, ResumeOfARunWithoutAWholeFrameBeginsIt) {
  simulate_to("0");
  fs::remove(run.checkpoint() / "0000.bin");
  const Finished resumed = simulate({"--resume", "--frames", "2"});
  EXPECT_EQ(resumed.status, 0) << resumed.errors;
  EXPECT_TRUE(fs::exists(run.mesh(2)));
}

TEST_F(Overwrite, TheCommandThatContinuesDoesNotOverwrite) {
  simulate_to("1");
  Program program({"sim", tiny, "--out", run.root.string(), "--overwrite"});
  while (const auto line = program.line())
    if (line->starts_with("frame 1/")) break;
  program.signal(SIGTERM);
  const Finished stopped = finish(program);
  ASSERT_EQ(stopped.status, 130) << stopped.errors;
  EXPECT_TRUE(contains(stopped.last_line(), run.root.string() + " --resume`")) << stopped.last_line();
}

// `hard/pile` and `pile` are two scenes with two folders. Two files of one name share a folder, and the
// second one is refused.
TEST(DefaultFolder, TellsScenesApart) {
  const ScratchFolder scratch;
  io::create_folder(scratch / "scenes/hard");
  io::create_folder(scratch / "mine");
  const std::string text = io::read_file(tiny);
  for (const char* file : {"scenes/drop.toml", "scenes/hard/drop.toml", "mine/drop.toml", "mine/own.toml"})
    io::write_atomically(scratch / file, text);
  const auto simulate = [&](const std::string& scene) {
    return run_duet({"sim", scene, "--frames", "1", "--quiet"}, scratch.path());
  };
  EXPECT_EQ(simulate("drop").status, 0);
  EXPECT_EQ(simulate("hard/drop").status, 0);
  EXPECT_EQ(simulate("mine/own.toml").status, 0);
  for (const char* folder : {"out/drop", "out/hard/drop", "out/own"})
    EXPECT_TRUE(fs::exists(scratch / folder / "mesh/0001.obj")) << folder;
  const Finished by_path = simulate("scenes/hard/drop.toml");
  EXPECT_EQ(by_path.status, 2);
  EXPECT_TRUE(contains(by_path.errors, "out/hard/drop: the folder holds 2 frames")) << by_path.errors;
  const Finished other = simulate("mine/drop.toml");
  EXPECT_EQ(other.status, 2);
  EXPECT_TRUE(contains(other.errors, "out/drop: the folder holds 2 frames")) << other.errors;
  EXPECT_EQ(run_duet({"overlaps", "hard/drop"}, scratch.path()).status, 0);
}

}  // namespace
}  // namespace duet::test::overwrite_test
