#include "sim/io/stage_log.h"

#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/step/world.h"

namespace duet::io::stage_log_test {
namespace {

class StageLogs : public testing::Test {
 protected:
  StageLogs() {
    scene_ = test::on_ground();
    test::add_ball(scene_, "first", Vec3(0, 0.3, 0), 0.25, 5);
    test::add_ball(scene_, "second", Vec3(2, 0.3, 0), 0.25, 5);
    test::add_soft_box(scene_, "cube", Vec3(5, 0.6, 0), Vec3(1, 1, 1), 1);
  }
  // Runs `frames` frames in a folder of that name, changes the world before the third one, and returns the
  // folder.
  template <class Change>
  RunDirectory run(const std::string& name, Change&& change, int frames = 3) {
    const RunDirectory directory{scratch_ / name};
    create_folder(directory.root);
    Simulation simulation(scene_, test::plan(scene_));
    StageLog log(directory, simulation.state_hashes());
    simulation.hash_stages([&](const StageRecord& record) { log.append(record); });
    for (int frame = 1; frame <= frames; ++frame) {
      if (frame == 3) change(simulation.world());
      simulation.advance_frame();
    }
    return directory;
  }
  RunDirectory run(const std::string& name, int frames = 3) {
    return run(
        name, [](World&) {}, frames);
  }

  scene::Scene scene_;
  const ScratchFolder scratch_;
};

TEST_F(StageLogs, OfTheSameSceneHaveNoDifference) {
  const StageComparison comparison = compare_stages(run("a"), run("b"));
  EXPECT_FALSE(comparison.difference);
  EXPECT_TRUE(comparison.same_length);
  EXPECT_GT(comparison.stages, 15);
  EXPECT_EQ(comparison.last_frame, 3);
  EXPECT_TRUE(comparison.text().ends_with("up to frame 3 are equal")) << comparison.text();
}

// A change of one velocity by 1e-13 m/s, which only the bits show, is located by frame, step, stage, quantity
// and body.
TEST_F(StageLogs, NameTheFirstStageQuantityAndBodyThatDiffer) {
  const RunDirectory plain = run("a"),
                     changed =
                         run("b", [](World&world) { world.bodies.rigid.state[1].velocity.z() += 1e-13; });
  const StageComparison comparison = compare_stages(plain, changed);
  ASSERT_TRUE(comparison.difference);
  EXPECT_EQ(comparison.difference->frame, 3);
  EXPECT_EQ(comparison.difference->step, 1);
  EXPECT_EQ(comparison.difference->stage, "step begins");
  EXPECT_EQ(comparison.difference->quantity, "velocity");
  EXPECT_EQ(comparison.difference->body, "second");
  EXPECT_EQ(comparison.difference->bodies, 1);
  EXPECT_TRUE(comparison.text().starts_with("frame 3, step 1, after `step begins`: velocity of `second` ("))
      << comparison.text();
}

TEST_F(StageLogs, NameParticlesAndQuantitiesOfTheScene) {
  const RunDirectory plain = run("a");
  const StageComparison soft =
      compare_stages(plain, run("b", [](World& world) { world.bodies.particles.v[3].y() += 1e-13; }));
  ASSERT_TRUE(soft.difference);
  EXPECT_EQ(soft.difference->quantity, "velocities");
  EXPECT_EQ(soft.difference->body, "cube");
  const StageComparison cache = compare_stages(plain, run("c", [](World& world) {
                                                 world.last_step.acceleration.linear.at(0).x() += 1;
                                                 world.last_step.acceleration.particle.at(0).x() += 1;
                                               }));
  ASSERT_TRUE(cache.difference);
  EXPECT_EQ(cache.difference->quantity, "particle accelerations");
  EXPECT_EQ(cache.difference->body, "");
  EXPECT_EQ(cache.difference->others, std::vector<std::string>{"linear accelerations"});
}

TEST_F(StageLogs, OfARunThatWasStoppedEarlierAreEqualAsFarAsTheyGo) {
  const StageComparison comparison = compare_stages(run("a", 2), run("b"));
  EXPECT_FALSE(comparison.difference);
  EXPECT_FALSE(comparison.same_length);
  EXPECT_EQ(comparison.last_frame, 2);
  EXPECT_TRUE(comparison.text().ends_with("; one of the runs ends there")) << comparison.text();
}

TEST_F(StageLogs, GoOnAfterTheFramesThatAResumedRunKeeps) {
  const RunDirectory whole = run("a"), stopped = run("b");
  const std::string text = read_file(stopped.stage_hashes());
  Simulation simulation(scene_, test::plan(scene_));
  simulation.advance_frame();
  {
    StageLog log(stopped, simulation.state_hashes(), 1);
    simulation.hash_stages([&](const StageRecord& record) { log.append(record); });
    simulation.advance_frame();
    simulation.advance_frame();
  }
  EXPECT_NE(read_file(stopped.stage_hashes()), text) << "its first line has all quantities anew";
  const StageComparison comparison = compare_stages(whole, stopped);
  EXPECT_FALSE(comparison.difference) << comparison.text();
  EXPECT_TRUE(comparison.same_length);
}

TEST_F(StageLogs, OfOtherScenesAreRefused) {
  const RunDirectory one = run("a", 1);
  scene_.rigid[0].name = "another";
  EXPECT_THROW(compare_stages(one, run("b", 1)), Error);
}

TEST_F(StageLogs, ThatAreMissingOrDamagedAreErrors) {
  const RunDirectory one = run("a", 1), none{scratch_ / "none"};
  EXPECT_THROW(compare_stages(one, none), FileError);
  const RunDirectory torn{scratch_ / "torn"};
  create_folder(torn.root);
  const std::string text = read_file(one.stage_hashes());
  write_atomically(torn.stage_hashes(), text.substr(0, text.size() - 9));
  EXPECT_THROW(compare_stages(one, torn), FileError);
}

}  // namespace
}  // namespace duet::io::stage_log_test
