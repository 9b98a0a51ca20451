// Tests of `duet compare` through the program.
#include <algorithm>

#include "tests/restart/program.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "render/picture.h"
#include "render/sequence.h"
#include "sim/base/files.h"
#include "sim/io/run_directory.h"

namespace duet::test::compare_test {
namespace {

class CompareCommand : public testing::Test {
 protected:
  // Draws a gray picture of 40 x 30 pixels with a white square that is `side` pixels wide, and returns its
  // path.
  std::string draw(const std::string& name, int side, int width = 40) const {
    std::vector<unsigned char> rgb(static_cast<std::size_t>(3 * width * 30), 100);
    for (int y = 0; y < side; ++y)
      for (int x = 0; x < 3 * side; ++x) rgb[static_cast<std::size_t>(3 * width * y + x)] = 255;
    const fs::path path = scratch_ / name;
    io::create_folder(path.parent_path());
    render::write_png(path.string(), width, 30, rgb);
    return path.string();
  }
  std::string path(const std::string& name) const { return (scratch_ / name).string(); }
  Finished compare(const std::vector<std::string>& arguments) const {
    std::vector<std::string> words = {"compare"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return run_duet(words, scratch_.path());
  }

  const ScratchFolder scratch_;
};

TEST_F(CompareCommand, StatusIsZeroForEqualAndOneForDifferent) {
  const std::string a = draw("a.png", 0), same = draw("same.png", 0), b = draw("b.png", 3);
  const Finished equal = compare({a, same});
  EXPECT_EQ(equal.status, 0) << equal.errors;
  EXPECT_EQ(equal.last_line(), "done: 1 picture the same within the bounds");
  const Finished different = compare({a, b});
  EXPECT_EQ(different.status, 1) << different.errors;
  ASSERT_EQ(different.output.size(), 2U);
  EXPECT_TRUE(contains(different.output[0], "largest patch 9 px")) << different.output[0];
  EXPECT_TRUE(different.last_line().starts_with("differs: a.png: RMSE ")) << different.last_line();
  EXPECT_EQ(different.errors, "");
}

TEST_F(CompareCommand, BoundsAreOptions) {
  const std::string a = draw("a.png", 0), b = draw("b.png", 3);
  EXPECT_EQ(compare({a, b, "--max-rmse", "0.1", "--max-share", "0.01", "--max-patch", "9"}).status, 0);
  EXPECT_EQ(compare({a, b, "--max-rmse", "0.1", "--max-share", "0.01", "--max-patch", "8"}).status, 1);
  EXPECT_EQ(compare({a, b, "--max-rmse", "0.1", "--max-share", "0.007", "--max-patch", "9"}).status, 1);
  EXPECT_EQ(compare({a, b, "--max-rmse", "0.1", "--tolerance", "155"}).status, 0) << "255 - 100";
  EXPECT_EQ(compare({a, b, "--max-rmse", "0.1", "--tolerance", "155", "--min-ssim", "0.999"}).status, 1);
  EXPECT_EQ(compare({a, b, "--tolerance", "256"}).status, 2);
}

TEST_F(CompareCommand, FoldersAreComparedByNameAndTheWorstIsNamed) {
  draw("one/0001.png", 2);
  draw("one/0002.png", 2);
  draw("one/0003.png", 2);
  draw("two/0001.png", 2);
  draw("two/0002.png", 6);
  draw("two/0003.png", 4);
  const Finished all = compare({"one", "two", "--difference", "seen"});
  EXPECT_EQ(all.status, 1);
  EXPECT_TRUE(all.last_line().starts_with("differs: 2 of 3 pictures; most 0002.png: ")) << all.last_line();
  for (const char* name : {"seen/0001.png", "seen/0002.png", "seen/0003.png"})
    EXPECT_EQ(render::read_picture(scratch_ / name).width, 40) << name;
  EXPECT_EQ(compare({"one", "two", "--frames", "1"}).status, 0);
  EXPECT_EQ(compare({"one", "two", "--frames", "1:2"}).status, 1);
}

TEST_F(CompareCommand, RunsAreComparedByTheirPictures) {
  for (const char* name : {"out/one", "two"}) {
    draw(std::string(name) + "/image/0000.png", 2);
    io::write_manifest({scratch_ / name}, io::Manifest{});
  }
  draw("two/ledger.png", 1);
  const Finished runs = compare({"one", "two"});  // `one` is found by its name in out/.
  EXPECT_EQ(runs.status, 0) << runs.errors;
  EXPECT_EQ(compare({"one", path("two/image")}).status, 0);
}

TEST_F(CompareCommand, MissingAndMismatchedPicturesAreNamed) {
  const std::string a = draw("a.png", 0), wide = draw("wide.png", 0, 50);
  draw("one/0001.png", 2);
  draw("one/0002.png", 2);
  draw("two/0001.png", 2);
  io::write_atomically(scratch_ / "torn.png", io::read_file(a).substr(0, 60));
  io::create_folder(scratch_ / "empty");
  struct Case {
    std::vector<std::string> arguments;
    int status;
    std::string message;
  };
  for (const Case& bad : {Case{{a, wide}, 2, "wide.png has 50 x 30"},
                          {{a, "one"}, 2, "a folder cannot be compared with a picture"},
                          {{a, a, "--frames", "1"}, 2, "--frames"},
                          {{a, "gone.png"}, 4, "gone.png: no such picture"},
                          {{a, "torn.png"}, 4, "torn.png: is no whole PNG"},
                          {{"one", "two"}, 4, "two/0002.png: is missing"},
                          {{"two", "one"}, 4, "two/0002.png: is missing"},
                          {{"empty", "empty"}, 4, "empty: has no pictures"}}) {
    const Finished finished = compare(bad.arguments);
    EXPECT_EQ(finished.status, bad.status) << bad.message;
    EXPECT_TRUE(contains(finished.errors, bad.message)) << finished.errors;
    EXPECT_TRUE(finished.last_line().starts_with("failed: ")) << finished.last_line();
  }
}

TEST_F(CompareCommand, JsonHasAllMeasures) {
  const Finished finished = compare({draw("a.png", 0), draw("b.png", 4), "--json"});
  EXPECT_EQ(finished.status, 1);
  ASSERT_EQ(finished.output.size(), 2U);
  const nlohmann::json pair = nlohmann::json::parse(finished.output[0]);
  EXPECT_EQ(pair["largest_patch"], 16);
  EXPECT_EQ(pair["same"], false);
  EXPECT_NEAR(pair["share"].get<double>(), 16.0 / 1200, 1e-12);
  EXPECT_NEAR(pair["maximum"].get<double>(), 155 / 255.0, 1e-12);
  for (const char* measure : {"mean", "rmse", "ssim"}) EXPECT_TRUE(pair[measure].is_number()) << measure;
  EXPECT_EQ(nlohmann::json::parse(finished.last_line())["status"], 1);
}

}  // namespace
}  // namespace duet::test::compare_test
