#include <algorithm>
#include <sstream>
#include <string>
#include <vector>

#include "tests/restart/program.h"
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"

namespace duet::test::run_totals_test {
namespace {

// A soft box of 1 m in the air, drawn as an octahedron that reaches 0.1 m out of each of its faces, or as the
// box itself. It stands 1 cm above the ground.
std::string box(bool is_drawn_as_octahedron) {
  return std::string("[ground]\nheight = 0\n[materials.rubber]\ndensity = 1000\nyoungs_modulus = 1e6\n") +
         "poisson_ratio = 0.4\ndamping = 0.02\n[[deformable]]\nname = \"block\"\n" +
         "shape = { box = [1, 1, 1], cells = [2, 2, 2] }\nposition = [0, 0.51, 0]\nmaterial = \"rubber\"\n" +
         (is_drawn_as_octahedron ? "skin = { mesh = \"octahedron.obj\" }\n" : "");
}

constexpr const char* octahedron =
    "v 0.6 0 0\nv -0.6 0 0\nv 0 0.6 0\nv 0 -0.6 0\nv 0 0 0.6\nv 0 0 -0.6\nf 1 3 5\nf 3 2 5\nf 2 4 5\nf 4 1 "
    "5\n"
    "f 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n";

Finished simulate(const ScratchFolder& folder, bool is_drawn_as_octahedron) {
  io::write_atomically(folder / "box.toml", box(is_drawn_as_octahedron));
  io::write_atomically(folder / "octahedron.obj", octahedron);
  return run_duet({"sim", (folder / "box.toml").string(), "--frames", "6", "--stats-only", "--out",
                   (folder / "run").string()});
}

// Returns the statistics of the frames.
std::vector<nlohmann::json> frames_of(const ScratchFolder& folder) {
  std::vector<nlohmann::json> frames;
  std::istringstream lines(io::read_file(folder / "run" / "stats.jsonl"));
  for (std::string line; std::getline(lines, line);) frames.push_back(nlohmann::json::parse(line));
  return frames;
}

// The last line tells how deep the drawn surface lies in the ground, of which body, and agrees with the
// search of `duet overlaps`. What touches stands on the ground.
TEST(RunTotals, TellHowDeepTheDrawnSurfaceLies) {
  const ScratchFolder folder;
  const Finished finished = simulate(folder, true);
  ASSERT_EQ(finished.status, 0) << finished.errors;
  const std::vector<nlohmann::json> frames = frames_of(folder);
  const auto depth_at = [](const nlohmann::json& frame) {
    return frame.at("drawn_penetration").get<double>();
  };
  const auto deepest = std::max_element(
      frames.begin(), frames.end(), [&](const auto& a, const auto& b) { return depth_at(a) < depth_at(b); });
  EXPECT_NEAR(depth_at(*deepest), 0.1, 0.01);
  const std::string told =
      fmt::format("; drawn surface of `block` at most {:.2g} m deep in `ground` (frame {})",
                  depth_at(*deepest), deepest->at("frame").get<int>());
  EXPECT_NE(finished.last_line().find(told), std::string::npos) << finished.last_line() << '\n' << told;
  const Finished overlaps =
      run_duet({"overlaps", (folder / "box.toml").string(), "--out", (folder / "run").string(), "--json"});
  ASSERT_EQ(overlaps.status, 0) << overlaps.errors;
  const nlohmann::json found = nlohmann::json::parse(overlaps.last_line());
  EXPECT_NEAR(found["drawn"]["depth"].get<double>(), depth_at(frames.back()), 1e-12);
  EXPECT_LT(found["deformable"]["depth"].get<double>(), 1e-3);
}

TEST(RunTotals, AreSilentAboutDrawnSurfacesThatTouch) {
  const ScratchFolder folder;
  const Finished finished = simulate(folder, false);
  ASSERT_EQ(finished.status, 0) << finished.errors;
  EXPECT_NE(finished.last_line().find("penetration at most "), std::string::npos) << finished.last_line();
  EXPECT_EQ(finished.last_line().find("drawn"), std::string::npos) << finished.last_line();
}

}  // namespace
}  // namespace duet::test::run_totals_test
