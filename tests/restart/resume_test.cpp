// Tests of what --resume says: why it refuses a run, how the run continues all the same, and what a continued
// run lacks.
#include "tests/restart/simulated_run.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"

namespace duet::test::resume_test {
namespace {

class Resume : public SimulatedRun {
 protected:
  const fs::path scene = scratch / "ball.toml", cube = scratch / "cube.obj";

  Resume() {
    io::write_atomically(cube, io::read_file(source_folder() + "/tests/faults/tetrahedron.obj"));
    write(io::read_file(tiny) +
          "\n[[rigid]]\nname = \"stone\"\nshape = { mesh = \"cube.obj\" }\nposition = [4, 3, 0]\nmass = 1\n");
  }
  void write(const std::string& text) const { io::write_atomically(scene, text); }
  // Replaces the first place of a text in the scene file.
  void edit(const std::string& before, const std::string& after) const {
    std::string text = io::read_file(scene);
    text.replace(text.find(before), before.size(), after);
    write(text);
  }
  Finished resume(std::vector<std::string> more) const {
    std::vector<std::string> words = {"sim",      scene.string(), "--out", run.root.string(),
                                      "--resume", "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    return run_duet(words);
  }
  // Checks that the run is not continued, and that the message says why and names the command that does.
  void expect_refused(const std::vector<std::string>& more, const std::string& why) const {
    const Finished refused = resume(more);
    EXPECT_EQ(refused.status, 2) << why;
    EXPECT_TRUE(contains(refused.errors, "nothing to resume for this scene: " + why)) << refused.errors;
    EXPECT_TRUE(contains(refused.errors, "`duet sim " + run.root.string() + " --resume --frames N` goes on"))
        << refused.errors;
  }
};

TEST_F(Resume, ARefusalSaysWhatDiffersAndHowTheRunGoesOn) {
  simulate(scene.string(), {"--frames", "2", "--set", "rigid.ball.mass=21"});
  const std::string set = "rigid.ball.mass=21", original = io::read_file(scene);
  expect_refused({}, "`rigid.ball.mass` is 20 and was 21 (");
  expect_refused({"--set", set, "--without", "rigid_deformable_contact"},
                 "--without leaves out rigid_deformable_contact and left out nothing");
  edit("frames = 40", "frames = 50");
  expect_refused({"--set", set}, "`frames` is 50 and was 40 (");
  edit("power = 600", "power = 700");
  expect_refused({"--set", set}, "`frames` is 50 and was 40; `lights.key.power` is 700 and was 600 (");
  edit("[camera]", "[camera]\nvertical_fov = 40");
  edit("mass = 20", "mass = 20\nvelocity = [0, -1, 0]");
  expect_refused({"--set", set},
                 "`camera.vertical_fov` is 40 and was not given; `frames` is 50 and was 40; ");
  write(original);
  edit("radius = 0.5\n", "");
  expect_refused({"--set", set}, "`lights.key.radius` is not given and was 0.5 (");
  write(original);
  std::string mesh = io::read_file(cube);
  io::write_atomically(cube, mesh.replace(mesh.find("v 0.2"), 5, "v 0.3"));
  expect_refused({"--set", set}, "the mesh cube.obj has changed");
  const Finished goes_on = run_duet({"sim", run.root.string(), "--resume", "--frames", "3", "--quiet"});
  EXPECT_EQ(goes_on.status, 0) << goes_on.errors;
  EXPECT_TRUE(fs::exists(run.mesh(3)));
}

TEST_F(Resume, ACommentIsNamedAsOne) {
  simulate(scene.string(), {"--frames", "2"});
  write("# a comment\n" + io::read_file(scene));
  expect_refused({}, "only comments or the layout of the scene file differ");
}

TEST_F(Resume, FramesWithoutMeshesAreNamedAtTheEnd) {
  simulate(scene.string(), {"--frames", "3", "--stats-only"});
  const Finished after_stats = resume({"--frames", "5"});
  EXPECT_EQ(after_stats.status, 0) << after_stats.errors;
  EXPECT_TRUE(contains(after_stats.last_line(), "; frames 0 to 3 have no meshes")) << after_stats.last_line();
  simulate(scene.string(), {"--frames", "2:4"});
  const Finished after_part = resume({"--frames", "6"});
  EXPECT_TRUE(contains(after_part.last_line(), "; frames 0 to 1 have no meshes")) << after_part.last_line();
  EXPECT_FALSE(contains(resume({"--frames", "2:7"}).last_line(), "no meshes"));
  simulate(scene.string(), {"--frames", "2", "--stats-only"});
  EXPECT_FALSE(contains(resume({"--frames", "3", "--stats-only"}).last_line(), "no meshes"));
}

// A checkpoint of another format is of another program, whatever its scene is.
TEST_F(Resume, OverlapsNamesTheProgramOfOtherCheckpoints) {
  simulate(scene.string(), {"--frames", "1"});
  const std::vector<std::string> words = {"overlaps", scene.string(), "--out", run.root.string()};
  EXPECT_EQ(run_duet(words).status, 0);
  const Finished other =
      run_duet({"overlaps", scene.string(), "--out", run.root.string(), "--set", "frames=9"});
  EXPECT_TRUE(contains(other.errors, "no whole checkpoint of this scene: `frames` is 9 and was 40"))
      << other.errors;
  for (const fs::path& file : io::files_in(run.checkpoint())) {
    std::string bytes = io::read_file(file);
    bytes[8] ^= 0x40;  // the number of the format
    io::write_atomically(file, bytes);
  }
  const Finished old = run_duet(words);
  EXPECT_EQ(old.status, 2);
  EXPECT_TRUE(contains(old.errors, "its checkpoints are of duet ")) << old.errors;
  EXPECT_TRUE(contains(old.errors, "this program cannot read them")) << old.errors;
}

}  // namespace
}  // namespace duet::test::resume_test
