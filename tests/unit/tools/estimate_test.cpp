// Tests of what `duet list`, `duet explain` and `duet check` say about the cost of a run.
#include <set>

#include "tests/restart/program.h"
#include "tests/support/text.h"
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"

namespace duet::test::estimate_test {
namespace {

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + '\n';
  return text;
}

nlohmann::json json_of(const Finished& finished) { return nlohmann::json::parse(joined(finished.output)); }

TEST(Estimate, ListHasAGroupAndACostForEveryShippedScene) {
  const Finished names = run_duet({"list", "--names"}), json = run_duet({"list", "--json"});
  ASSERT_EQ(json.status, 0) << json.errors;
  const nlohmann::json listed = json_of(json);
  EXPECT_EQ(listed.at("scenes").size(), names.output.size());
  EXPECT_FALSE(listed.at("machine").get<std::string>().empty());
  EXPECT_TRUE(contains(listed.at("program").get<std::string>(), "numerics"));
  std::set<std::string> groups;
  for (const nlohmann::json& scene : listed.at("scenes")) {
    groups.insert(scene.at("group"));
    EXPECT_GE(scene.at("shows").get<std::string>().size(), 15U) << scene;
    ASSERT_TRUE(scene.contains("seconds")) << scene.at("name") << ": tools/scene-costs measures it";
    EXPECT_GT(scene.at("seconds"), 0) << scene;
    EXPECT_GT(scene.at("bytes"), 1000) << scene;
  }
  EXPECT_EQ(groups.size(), 3U);
}

TEST(Estimate, ListSaysWhatAStackShows) {
  const Finished list = run_duet({"list"});
  ASSERT_EQ(list.status, 0) << list.errors;
  EXPECT_TRUE(contains(joined(list.output), "Silver rigid boxes and orange deformable boxes form a stack"));
  EXPECT_TRUE(contains(joined(list.output), "Hard scenes"));
}

// A run of four frames writes as much as the estimate of one frame says.
TEST(Estimate, BytesAreThoseOfARun) {
  const ScratchFolder scratch;
  const std::vector<std::string> picture = {"--set", "render.width=160", "--set", "render.height=90"};
  std::vector<std::string> run =
                               {"run", tiny, "--frames", "4", "--quiet", "--out", (scratch / "run").string()},
                           explain = {"explain", tiny, "--estimate", "--samples", "0.1", "--json"};
  run.insert(run.end(), picture.begin(), picture.end());
  explain.insert(explain.end(), picture.begin(), picture.end());
  ASSERT_EQ(run_duet(run).status, 0);
  const Finished explained = run_duet(explain, scratch.path());
  ASSERT_EQ(explained.status, 0) << explained.errors;
  const nlohmann::json estimate = json_of(explained).at("estimate");
  const io::RunDirectory written{scratch / "run"};
  const auto bytes =
      static_cast<double>(fs::file_size(written.mesh(4)) + fs::file_size(written.values(4)) +
                          fs::file_size(written.level_set(4)) + fs::file_size(written.stats()) / 5);
  EXPECT_NEAR(estimate.at("bytes_a_frame").get<double>() / bytes, 1, 0.15);
  EXPECT_NEAR(
      estimate.at("picture_bytes").get<double>() / static_cast<double>(fs::file_size(written.image(1))), 1,
      0.3);
  EXPECT_GE(estimate.at("sampled").at("frames"), 1);
  EXPECT_GT(estimate.at("simulation_seconds"), 0);
  EXPECT_GT(estimate.at("memory"), 1e7);
  EXPECT_FALSE(fs::exists(scratch / "out")) << "an estimate leaves nothing behind";
}

TEST(Estimate, ExplainWithoutItSimulatesNothingAndSaysSo) {
  const Finished explained = run_duet({"explain", tiny});
  ASSERT_EQ(explained.status, 0) << explained.errors;
  EXPECT_TRUE(contains(joined(explained.output), "nothing was simulated: --estimate"))
      << joined(explained.output);
  EXPECT_TRUE(contains(joined(explained.output), "a frame and ")) << joined(explained.output);
  const Finished shipped = run_duet({"explain", "stack"});
  EXPECT_TRUE(contains(joined(shipped.output), " s of processor time each on ")) << joined(shipped.output);
}

// Drawing pictures of 16384 x 16384 pixels takes 15 GB of memory, more than some machines have, and small
// ones 0.2 GB.
TEST(Estimate, WarnsOfMemoryIfAndOnlyIfItDoesNotSuffice) {
  for (const char* pixels : {"16384", "64"}) {
    const std::string width = fmt::format("render.width={}", pixels),
                      height = fmt::format("render.height={}", pixels);
    const Finished explained = run_duet(
        {"explain", tiny, "--json", "--set", width, "--set", height, "--set", "render.supersampling=1"});
    ASSERT_EQ(explained.status, 0) << explained.errors;
    const nlohmann::json json = json_of(explained), estimate = json.at("estimate");
    const double needed = estimate.at("memory").get<double>() + estimate.at("drawing_memory").get<double>();
    EXPECT_EQ(needed > 1e10, std::string(pixels) == "16384");
    EXPECT_EQ(contains(json.at("warnings").dump(), " of memory and drawing "),
              needed > estimate.at("free_memory").get<double>())
        << json.at("warnings");
  }
}

// A million pictures of 16384 x 16384 pixels are more than any disk here.
TEST(Estimate, CheckAndExplainWarnOfSmallDisks) {
  const std::vector<std::string> large = {"--set", "frames=1000000",     "--set", "render.width=16384",
                                          "--set", "render.height=16384"};
  for (const char* command : {"check", "explain"}) {
    std::vector<std::string> words = {command, tiny};
    words.insert(words.end(), large.begin(), large.end());
    const Finished finished = run_duet(words);
    EXPECT_EQ(finished.status, 0) << finished.errors;
    EXPECT_TRUE(contains(joined(finished.output), "a run of 1000000 frames takes about "))
        << joined(finished.output);
    EXPECT_TRUE(contains(joined(finished.output), "give --out on another file system"))
        << joined(finished.output);
  }
}

}  // namespace
}  // namespace duet::test::estimate_test
