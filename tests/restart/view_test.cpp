// `duet view` as a user meets it: the page has the run in it, refusals leave nothing, and names do nothing.
#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "tests/restart/program.h"
#include "tests/restart/simulated_run.h"
#include "tests/restart/view_page.h"
#include "tests/support/text.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"
#include "sim/io/run_journal.h"
#include "sim/io/values_file.h"

namespace duet::test::view_test {
namespace {

using view_page::ViewPage;

class View : public SimulatedRun {
 protected:
  Finished view(const std::vector<std::string>& more = {}, const char* how = "--quiet") const {
    std::vector<std::string> words = {"view", "run", how};
    words.insert(words.end(), more.begin(), more.end());
    return run_duet(words, scratch.path());
  }
  ViewPage page() const { return ViewPage(html()); }
  std::string html() const { return io::read_file(run.root / "view.html"); }
  std::set<fs::path> files() const {
    std::set<fs::path> found;
    for (const auto& entry : fs::recursive_directory_iterator(scratch.path())) found.insert(entry.path());
    return found;
  }
  void refuse(int status, const std::vector<std::string>& more, const std::string& said) const {
    const std::set<fs::path> before = files();
    const Finished refused = view(more);
    EXPECT_EQ(refused.status, status) << said << ": " << refused.last_line();
    EXPECT_TRUE(contains(refused.errors, said)) << said << ": " << refused.errors;
    EXPECT_EQ(files(), before) << "nothing is left behind";
  }
};

// The promise is 1e-4 of the size of a body. The rounding is 2^-17 of its largest extents, 13 times less.
TEST_F(View, PositionsAreThoseOfTheMeshes) {
  for (const char* scene : {tiny.c_str(), "hard/soft_on_soft", "hard/kinematic"}) {
    simulate(scene, {"--frames", "2", "--accuracy", "draft"});
    ASSERT_EQ(view({"--overwrite"}).status, 0) << scene;
    const ViewPage shown = page();
    ASSERT_EQ(shown.frames(), (std::vector<int>{0, 1, 2})) << scene;
    for (const int frame : shown.frames())
      for (const BodySurface& body : io::read_mesh(run, frame)) {
        const std::vector<Vec3> positions = shown.positions(body.name, as_index(frame));
        ASSERT_EQ(positions.size(), body.surface.positions.size()) << scene << " " << body.name;
        Eigen::AlignedBox3d box;
        double farthest = 0;
        for (std::size_t i = 0; i < positions.size(); ++i) {
          box.extend(positions[i]);
          farthest = std::max(farthest, (positions[i] - body.surface.positions[i]).norm());
        }
        EXPECT_LT(farthest, 1e-4 * box.diagonal().norm()) << scene << " " << body.name << " frame " << frame;
      }
  }
}

TEST_F(View, SaysWhatIsInThePageAndWhere) {
  simulate(tiny, {"--frames", "3"});
  const Finished done = view();
  EXPECT_TRUE(done.last_line().starts_with("done: 4 frames of 2 bodies, ")) << done.last_line();
  EXPECT_TRUE(contains(done.last_line(), "B, in run/view.html, ")) << done.last_line();
  const nlohmann::json described = page().run();
  EXPECT_EQ(described.at("title"), "Tiny");
  EXPECT_EQ(described.at("fps"), 24);
  EXPECT_EQ(described.at("every"), 1);
  EXPECT_EQ(described.at("stats").at("frame"), (std::vector<int>{0, 1, 2, 3}));
  EXPECT_GT(described.at("stats").at("potential").at(3), 0);
  EXPECT_EQ(described.at("notes").size(), 0U);
  EXPECT_EQ(run_duet({"verify", "run", "--quiet"}, scratch.path()).status, 0) << "a page is no damage";
}

// The page is one file: it names nothing that a browser would fetch.
TEST_F(View, AsksForNothing) {
  simulate(tiny, {"--frames", "1"});
  ASSERT_EQ(view().status, 0);
  const std::string text = html();
  for (const char* word : {" src=", "@import", "url(", "fetch(", "XMLHttpRequest", "import(", "https://"})
    EXPECT_FALSE(contains(text, word)) << word;
  EXPECT_TRUE(contains(text, "default-src 'none'"));
}

TEST_F(View, VerticesThatTouchAreMarkedAndOthersAreNot) {
  simulate(tiny, {"--frames", "1"});
  ASSERT_EQ(view().status, 0);
  const ViewPage shown = page();
  const std::vector<std::uint8_t> cube = shown.near("cube", 0);
  const std::vector<Vec3> positions = shown.positions("cube", 0);
  ASSERT_EQ(cube.size(), positions.size());
  for (std::size_t i = 0; i < cube.size(); ++i)
    EXPECT_EQ(cube[i] > 200, positions[i].y() < 0.001) << "the cube stands on the ground " << positions[i];
  EXPECT_TRUE(shown.near("ball", 0).empty()) << "the ball falls";
}

// A byte has the root of a share of the largest value, so that it is off by 1/255 of the root at most.
void expect_root_bytes(const std::vector<double>& shown, std::span<const float> expected, double largest) {
  ASSERT_EQ(shown.size(), expected.size());
  EXPECT_GT(*std::max_element(expected.begin(), expected.end()), 0);
  for (std::size_t i = 0; i < shown.size(); ++i)
    EXPECT_NEAR(std::sqrt(shown[i] / largest), std::sqrt(static_cast<double>(expected[i]) / largest), 0.005);
}

TEST_F(View, HasStressesAndLoadsOfContact) {
  simulate(tiny, {"--frames", "12"});
  ASSERT_EQ(view().status, 0);
  const ViewPage shown = page();
  const io::FrameValues values = io::read_values(run, io::read_manifest(run).bodies, 12);
  ASSERT_EQ(values.points.size(), shown.positions("cube", 12).size()) << "the cube is the deformable body";
  expect_root_bytes(shown.stress("cube", 12), values.stress, shown.run().at("max_stress"));
  expect_root_bytes(shown.pressure("cube", 12), values.contact.pressure, shown.run().at("max_pressure"));
  EXPECT_TRUE(shown.pressure("cube", 0).empty()) << "no load before the first step";
  Vec3 on_cube = Vec3::Zero();
  for (const Vec3f& force : values.contact.force) on_cube += force.cast<double>();
  EXPECT_GT(on_cube.y(), 0) << "the ground carries it";
  EXPECT_LT((shown.contact_force("cube", 12) - on_cube).norm(), 1e-5 * on_cube.norm());
  const Vec3 on_ball = values.contact.rigid_force.at(0);
  EXPECT_LT((shown.contact_force("ball", 12) - on_ball).norm(), 1e-5 * on_ball.norm() + 1e-9);
}

TEST_F(View, ChoosesBodiesAndFrames) {
  simulate(tiny, {"--frames", "6"});
  ASSERT_EQ(view({"--bodies", "b*", "--frames", "2:4"}).status, 0);
  EXPECT_EQ(page().frames(), (std::vector<int>{2, 3, 4}));
  EXPECT_EQ(page().run().at("bodies").size(), 1U);
  refuse(2, {"--bodies", "bal", "--out", "none.html"}, "did you mean `ball`?");
  refuse(2, {"--frames", "7:9", "--out", "none.html"}, "it has frames 0 to 6");
}

// A page of more than --max-size has every second, third ... frame, and the last one.
TEST_F(View, LeavesFramesOutWhereThePageWouldBeTooLarge) {
  simulate(tiny, {"--set", "frames=150"});
  ASSERT_EQ(view().status, 0);
  EXPECT_EQ(page().frames().size(), 151U);
  const double all = static_cast<double>(fs::file_size(run.root / "view.html")), most = 0.85 * all;
  const Finished done = view({"--overwrite", "--max-size", fmt::format("{}", most / 1e6)}, "--json");
  ASSERT_EQ(done.status, 0) << done.errors;
  EXPECT_LE(static_cast<double>(fs::file_size(run.root / "view.html")), most);
  const ViewPage shown = page();
  const std::vector<int> frames = shown.frames();
  const int every = shown.run().at("every");
  EXPECT_GE(every, 2);
  EXPECT_EQ(frames.at(1), every);
  EXPECT_EQ(frames.back(), 150);
  const std::string note = shown.run().at("notes").at(0);
  EXPECT_TRUE(contains(note, fmt::format("with all 151 frames (--max-size): it has every {}", every)))
      << note;
  EXPECT_TRUE(std::any_of(done.output.begin(), done.output.end(), [](const std::string& line) {
    return contains(line, "--max-size");
  })) << "the program says it, too";
  const Vec3 last = shown.positions("cube", frames.size() - 1).at(7);
  EXPECT_LT((last - io::read_mesh(run, 150).at(1).surface.positions.at(7)).norm(), 1e-4);
  refuse(2, {"--max-size", "0.1", "--out", "none.html"}, "--max-size: two frames of these bodies take more");
}

// What the names hold is shown, and nothing that it says is done: it ends no element and begins none.
TEST_F(View, NamesDoNothing) {
  const std::string hostile = "</script><img src=x onerror=alert(1)><!--<script>";
  simulate(tiny, {"--frames", "1"});
  std::string manifest = io::read_file(run.manifest());
  for (const std::string before : {"\"ball\"", "\"Tiny\""})
    manifest.replace(manifest.find(before), before.size(), nlohmann::json(hostile).dump());
  io::write_atomically(run.manifest(), manifest);
  fs::remove(io::journal_path(run.root));  // which would tell that it was changed
  ASSERT_EQ(view().status, 0);
  const std::string text = html();
  for (const char* part : {"<img", "</script><", "<!--<"}) EXPECT_FALSE(contains(text, part)) << part;
  EXPECT_EQ(page().run().at("title"), hostile);
  EXPECT_EQ(page().positions(hostile, 1).size(), io::read_mesh(run, 1).at(0).surface.positions.size());
}

TEST_F(View, RefusesWhatItCannotDo) {
  simulate(tiny, {"--frames", "1"});
  ASSERT_EQ(view().status, 0);
  refuse(2, {}, "run/view.html: is there already");
  EXPECT_EQ(view({"--overwrite"}).status, 0);
  refuse(2, {"--overwrite", "--out", "run/scene.toml"}, "run/scene.toml: is no page of `duet view`");
  refuse(2, {"--overwrite", "--out", "run"}, "run: is no page of `duet view`");
  refuse(4, {"--out", "/proc/duet-test/page.html"}, "cannot");
  for (const char* size : {"0", "nan", "x", "1e9"}) refuse(2, {"--max-size", size}, "--max-size");
  const Finished nowhere = run_duet({"view", "nowhere"}, scratch.path());
  EXPECT_EQ(nowhere.status, 4);
  EXPECT_TRUE(contains(nowhere.errors, "nowhere: is no run directory")) << nowhere.errors;
  std::string other = io::read_file(run.values(1));
  other.back() ^= 1;
  io::write_atomically(run.values(1), other);
  refuse(4, {"--out", "none.html"}, "run/values/0001.npy: is damaged");
}

// What is there is shown, and what is not is named.
TEST_F(View, ShowsWhatIsThere) {
  simulate(tiny, {"--frames", "6"});
  for (const int frame : {2, 3, 5}) io::remove_file(run.values(frame));
  ASSERT_EQ(view().status, 0);
  EXPECT_EQ(page().frames(), (std::vector<int>{0, 1, 4, 6}));
  EXPECT_EQ(page().run().at("notes").at(0), "frames 2 to 3, 5 are not in the run");

  simulate(tiny, {"--frames", "2", "--stats-only"});
  const Finished statistics = view({"--overwrite"});
  ASSERT_EQ(statistics.status, 0) << statistics.errors;
  EXPECT_TRUE(statistics.last_line().starts_with("done: 3 frames of 0 bodies, ")) << statistics.last_line();
  EXPECT_TRUE(contains(page().run().at("notes").at(0), "the run has no motion of its bodies"));

  fs::remove(io::journal_path(run.root));  // which would tell of what follows
  io::write_atomically(run.stats(), "");
  refuse(4, {"--out", "none.html"}, "run: has no frame yet");
  io::remove_file(run.stats());
  refuse(4, {"--out", "none.html"}, "run/values/bodies.npy");
}

}  // namespace
}  // namespace duet::test::view_test
