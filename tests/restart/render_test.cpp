// Tests of `duet render`: which frames it draws, and which pictures it never replaces.
#include <map>

#include "tests/restart/simulated_run.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"

namespace duet::test::render_test {
namespace {

class Render : public SimulatedRun {
 protected:
  // Calls duet render for `run`.
  Finished render(std::vector<std::string> more) const {
    std::vector<std::string> words = {"render", run.root.string(), "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    return run_duet(words);
  }
  // Returns the bytes of all files of a folder.
  static std::map<fs::path, std::string> all_files(const fs::path& folder) {
    std::map<fs::path, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file()) files[entry.path()] = io::read_file(entry.path());
    return files;
  }
};

TEST_F(Render, PicturesOfAnotherRunStayUntouched) {
  simulate(tiny, {"--frames", "1"});
  const fs::path other = scratch / "other";
  ASSERT_EQ(run_duet({"run", tiny, "--out", other.string(), "--frames", "1", "--set", "ground.height=-1",
                      "--quiet"})
                .status,
            0);
  const auto before = all_files(other);
  for (const std::vector<std::string>& more :
       {std::vector<std::string>{}, {"--missing"}, {"--skip-existing"}}) {
    std::vector<std::string> words = {"--out", other.string()};
    words.insert(words.end(), more.begin(), more.end());
    const Finished refused = render(words);
    EXPECT_EQ(refused.status, 2) << refused.errors;
    EXPECT_TRUE(contains(refused.errors, "the folder holds another run")) << refused.errors;
    EXPECT_TRUE(contains(refused.errors, "another folder with --out")) << refused.errors;
    EXPECT_TRUE(all_files(other) == before);
  }
}

// --out with the folder of the run itself: the journal lists the new pictures as without --out.
TEST_F(Render, TheFolderOfTheRunIsNoOtherFolder) {
  simulate(tiny, {"--frames", "1"});
  ASSERT_EQ(render({}).status, 0);
  ASSERT_EQ(render({"--out", run.root.string() + "/.", "--set", "render.exposure=2"}).status, 0);
  const Finished verified = run_duet({"verify", run.root.string()});
  EXPECT_EQ(verified.status, 0) << verified.errors;
}

TEST_F(Render, FramesThatTheRunLacksAreNamed) {
  simulate(tiny, {"--frames", "4"});
  const Finished some = render({"--frames", "3:30"});
  EXPECT_EQ(some.status, 0) << some.errors;
  EXPECT_TRUE(contains(some.last_line(), "2 pictures in ")) << some.last_line();
  EXPECT_TRUE(contains(some.last_line(), "; frames 5 to 30 are not there")) << some.last_line();
  EXPECT_TRUE(fs::exists(run.image(4)));
  const Finished none = render({"--frames", "20:30"});
  EXPECT_EQ(none.status, 2);
  EXPECT_TRUE(contains(none.errors, "has none of the frames that are asked for; it has frames 0 to 4"))
      << none.errors;
  const Finished exported =
      run_duet({"export", run.root.string(), "--to", "obj", "--frames", "3:30", "--quiet"});
  EXPECT_TRUE(contains(exported.last_line(), "; frames 5 to 30 are not there")) << exported.last_line();
  io::remove_file(run.mesh(3));
  const Finished lost = render({"--frames", "3:4"});
  EXPECT_EQ(lost.status, 4) << "a frame that the run wrote and lost is a fault";
  EXPECT_TRUE(contains(lost.errors, "0003.obj")) << lost.errors;
}

}  // namespace
}  // namespace duet::test::render_test
