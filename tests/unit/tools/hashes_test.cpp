// Tests of `duet hashes` and of `duet sim --hash-stages` through the program.
#include "tests/restart/program.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"

namespace duet::test::hashes_test {
namespace {

class HashesCommand : public testing::Test {
 protected:
  HashesCommand() {
    write_scene("1");
    table("[tiny]\nscene = \"tiny.toml\"\nshort = 2\nlater = 4\n");
  }
  void write_scene(const std::string& height) const {  // `height` of the ball in m
    std::string text = io::read_file(source_folder() + "/tests/restart/tiny.toml");
    const std::string position = "position = [0.05, 1, 0]";
    text.replace(text.find(position), position.size(), "position = [0.05, " + height + ", 0]");
    io::write_atomically(scratch_ / "tiny.toml", text);
  }
  void table(const std::string& text) const {
    io::create_folder(scratch_ / "expected");
    io::write_atomically(scratch_ / "expected/frames.toml", text);
  }
  Finished hashes(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {"hashes", "--expected", "expected"});
    return run_duet(arguments, scratch_.path());
  }
  std::string file() const { return io::read_file(scratch_ / "expected/tiny.txt"); }

  const ScratchFolder scratch_;
};

TEST_F(HashesCommand, WhatIsWrittenIsFoundAgain) {
  const Finished written = hashes({"--write", "--full"});
  EXPECT_EQ(written.status, 0) << written.errors;
  EXPECT_TRUE(written.output.at(0).starts_with("new      tiny")) << written.output[0];
  for (const char* part :
       {"frame 0 ", "frame 2 ", "frame 4 ", "\n  rigid ball ", "\n  deformable cube ", "\n  scene "})
    EXPECT_TRUE(contains(file(), part)) << part;
  EXPECT_FALSE(contains(file(), "frame 3 "));
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{"tiny"}, {"--full", "--threads", "1"}, {"--seconds", "100"}}) {
    const Finished equal = hashes(options);
    EXPECT_EQ(equal.status, 0) << equal.errors;
    EXPECT_TRUE(equal.output.at(0).starts_with("equal    tiny")) << equal.output[0];
    EXPECT_EQ(equal.last_line(), "done: 1 of 1 scenes have the expected hashes");
  }
  EXPECT_TRUE(hashes({"--write", "--full"}).output.at(0).starts_with("same     tiny"));
}

TEST_F(HashesCommand, MissingHashesAreNoSuccess) {
  const Finished nothing = hashes({});
  EXPECT_EQ(nothing.status, 4);
  EXPECT_TRUE(contains(nothing.output.at(0), "is missing")) << nothing.output[0];
  ASSERT_EQ(hashes({"--write"}).status, 0);
  EXPECT_EQ(hashes({}).status, 0);
  const Finished later = hashes({"--full"});
  EXPECT_EQ(later.status, 4);
  EXPECT_TRUE(contains(later.output.at(0), "has no hash of frame 4")) << later.output[0];
  table("[tiny]\nscene = \"tiny.toml\"\nshort = 3\n");
  EXPECT_EQ(hashes({}).status, 4) << "of a frame more than the file has";
  table("");
  EXPECT_EQ(hashes({}).status, 4);
  fs::remove_all(scratch_ / "expected");
  EXPECT_EQ(hashes({}).status, 4);
}

TEST_F(HashesCommand, ADifferenceHasFrameBodyAndQuantity) {
  ASSERT_EQ(hashes({"--write"}).status, 0);
  write_scene("1.1");
  const Finished differs = hashes({"--json"});
  EXPECT_EQ(differs.status, 1);
  const nlohmann::json object = nlohmann::json::parse(differs.output.at(0));
  EXPECT_EQ(object["status"], "differs");
  EXPECT_EQ(object["frame"], 0);
  EXPECT_EQ(object["body"], "ball");
  EXPECT_EQ(object["quantity"], "position");
  EXPECT_TRUE(contains(object["message"], "--hash-stages")) << object["message"];
  EXPECT_TRUE(hashes({"--write"}).output.at(0).starts_with("changed  tiny"));
  EXPECT_EQ(hashes({}).status, 0);
}

TEST_F(HashesCommand, RenewingTheFirstFramesLeavesTheLaterOneAlone) {
  ASSERT_EQ(hashes({"--write", "--full"}).status, 0);
  const std::string before = file();
  EXPECT_TRUE(hashes({"--write"}).output.at(0).starts_with("same     tiny"));
  EXPECT_EQ(file(), before);
}

TEST_F(HashesCommand, SaysWhatIsWrongWithATable) {
  for (const auto& [text, message] :
       std::vector<std::pair<std::string, std::string>>{{"[tiny]\n", "short"},
                                                        {"[tiny]\nshort = -1\n", "number of a frame"},
                                                        {"[tiny]\nshort = 1\nlonger = 2\n", "longer"},
                                                        {"[tiny]\nshort = 2\nlater = 2\n", "later"},
                                                        {"[tiny\n", "line 1"},
                                                        {"tiny = 1\n", "no table"}}) {
    table(text);
    const Finished bad = hashes({});
    EXPECT_EQ(bad.status, 4) << text;
    EXPECT_TRUE(contains(bad.errors, message)) << bad.errors;
  }
  table("[tiny]\nshort = 1\n");
  const Finished unknown = hashes({"tinny"});
  EXPECT_EQ(unknown.status, 2);
  EXPECT_TRUE(contains(unknown.errors, "did you mean `tiny`?")) << unknown.errors;
  EXPECT_EQ(hashes({"--write", "--seconds", "1"}).status, 2);
}

TEST_F(HashesCommand, StagesOfTwoRunsAreCompared) {
  const auto simulate = [&](const std::string& out) {
    return run_duet({"sim", "tiny.toml", "--frames", "2", "--stats-only", "--hash-stages", "--overwrite",
                     "--out", out},
                    scratch_.path())
        .status;
  };
  ASSERT_EQ(simulate("a"), 0);
  ASSERT_EQ(simulate("b"), 0);
  EXPECT_EQ(run_duet({"hashes", "--stages", "a", "b"}, scratch_.path()).status, 0);
  write_scene("1.1");
  ASSERT_EQ(simulate("b"), 0);
  const Finished differs = run_duet({"hashes", "--stages", "a", "b"}, scratch_.path());
  EXPECT_EQ(differs.status, 1);
  EXPECT_TRUE(contains(differs.last_line(), "frame 1, step 1, after `step begins`: position of `ball`"))
      << differs.last_line();
  ASSERT_EQ(run_duet({"sim", "tiny.toml", "--frames", "1", "--stats-only", "--overwrite", "--out", "b"},
                     scratch_.path())
                .status,
            0);
  EXPECT_EQ(run_duet({"hashes", "--stages", "a", "b"}, scratch_.path()).status, 4)
      << "a new run has its own stages";
  EXPECT_EQ(run_duet({"hashes", "--stages", "a", "b", "--full"}, scratch_.path()).status, 2);
}

// A run that was resumed has the stages of one that was not, also where bodies touch.
TEST_F(HashesCommand, StagesOfAResumedRunAreThoseOfTheWhole) {
  const auto simulate = [&](const std::string& out, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"sim", "touching.toml", "--stats-only", "--hash-stages", "--out", out};
    words.insert(words.end(), more.begin(), more.end());
    return run_duet(words, scratch_.path()).status;
  };
  io::write_atomically(scratch_ / "touching.toml",
                       "frames = 4\n[ground]\nheight = 0\n[[rigid]]\nname = \"box\"\nmass = 1\n"
                       "shape = { box = [1, 1, 1] }\nposition = [0, 0.5, 0]\nvelocity = [1, 0, 0]\n");
  ASSERT_EQ(simulate("a", {}), 0);
  ASSERT_EQ(simulate("b", {"--frames", "2"}), 0);
  ASSERT_EQ(simulate("b", {"--resume"}), 0);
  const Finished compared = run_duet({"hashes", "--stages", "a", "b"}, scratch_.path());
  EXPECT_EQ(compared.status, 0) << compared.last_line();
}

}  // namespace
}  // namespace duet::test::hashes_test
