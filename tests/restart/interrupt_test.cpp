// Tests that SIGINT and SIGTERM end a run in the middle of a frame, which would take minutes, and lose
// nothing.
#include <csignal>
#include <memory>

#include "tests/restart/program.h"
#include "tests/support/places.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"

namespace duet::test::interrupt_test {
namespace {

// This step makes about 400,000 substeps per frame.
const std::string long_frames = "solver.max_time_step=1e-7";

class Interrupt : public testing::Test {
 protected:
  ScratchFolder scratch;
  io::RunDirectory run{scratch / "run"};

  // Starts the run and waits until it is in the middle of frame 1.
  std::unique_ptr<Program> start(const std::string& command = "sim") const {
    auto program = std::make_unique<Program>(std::vector<std::string>{
        command, tiny, "--out", run.root.string(), "--set", long_frames, "--set", "render.width=64"});
    while (const auto line = program->line())
      if (line->starts_with("frame 0/")) break;
    program->compute_for(0.1);
    return program;
  }
};

TEST_F(Interrupt, EndsALongFrameAndSaysWhichWasGivenUp) {
  for (const auto& [command, signal] : {std::pair{"sim", SIGINT}, {"sim", SIGTERM}, {"run", SIGTERM}}) {
    fs::remove_all(run.root);
    const auto program = start(command);
    program->signal(signal);
    const Finished stopped = finish(*program);
    EXPECT_EQ(stopped.status, 130);
    EXPECT_TRUE(contains(stopped.errors, "a second signal ends the program at once")) << stopped.errors;
    EXPECT_TRUE(contains(stopped.last_line(), "frame 1 was given up; frames up to 0 are whole"))
        << stopped.last_line();
    EXPECT_TRUE(contains(stopped.last_line(), "--resume`")) << stopped.last_line();
    EXPECT_TRUE(fs::exists(run.mesh(0)));
    EXPECT_FALSE(fs::exists(run.mesh(1)));
    EXPECT_TRUE(io::holds_bytes(run.checkpoint() / "0000.bin"));
  }
}

TEST_F(Interrupt, ASecondSignalEndsAtOnce) {
  const auto program = start();
  program->signal(SIGSTOP);  // Both signals arrive before the program can answer the first one.
  program->signal(SIGINT);
  program->signal(SIGTERM);
  program->signal(SIGCONT);
  const Finished stopped = finish(*program);
  EXPECT_EQ(stopped.status, 130);
  EXPECT_TRUE(contains(stopped.errors, "ended at once")) << stopped.errors;
}

// Frames of some 10,000 steps take less than a second. The frame before tells that, so that the first signal
// lets the frame end.
const std::string frames_of_a_second = "solver.max_time_step=4e-6";

TEST_F(Interrupt, FinishesAFrameThatTakesSeconds) {
  for (const int signal : {SIGINT, SIGTERM}) {
    fs::remove_all(run.root);
    Program program({"sim", tiny, "--out", run.root.string(), "--set", frames_of_a_second});
    while (const auto line = program.line())
      if (line->starts_with("frame 1/")) break;
    program.compute_for(0.05);
    program.signal(signal);
    const Finished stopped = finish(program);
    EXPECT_EQ(stopped.status, 130);
    EXPECT_TRUE(contains(stopped.errors, "frame 2 is being finished, in about ")) << stopped.errors;
    EXPECT_TRUE(contains(stopped.errors, "a second signal ends the program at once")) << stopped.errors;
    EXPECT_TRUE(contains(stopped.last_line(), "after frame 2; frames up to 2 are whole"))
        << stopped.last_line();
    EXPECT_TRUE(fs::exists(run.mesh(2)));
  }
}

// SIGALRM is the signal with which the system tells that ten seconds are over.
TEST_F(Interrupt, GivesAFrameUpThatTakesTooLongToFinish) {
  Program program({"sim", tiny, "--out", run.root.string(), "--set", frames_of_a_second});
  while (const auto line = program.line())
    if (line->starts_with("frame 1/")) break;
  program.compute_for(0.05);
  program.signal(SIGINT);
  program.compute_for(0.02);
  program.signal(SIGALRM);
  const Finished stopped = finish(program);
  EXPECT_EQ(stopped.status, 130);
  EXPECT_TRUE(contains(stopped.errors, "takes longer than expected and is given up")) << stopped.errors;
  EXPECT_TRUE(contains(stopped.last_line(), "frame 2 was given up; frames up to 1 are whole"))
      << stopped.last_line();
}

// A frame that was given up is computed to the same bits afterwards. Its thousand steps make sure that the
// signals arrive in the middle of a frame.
TEST_F(Interrupt, AGivenUpFrameIsComputedToTheSameBits) {
  const std::vector<std::string> scene = {"--set", "solver.max_time_step=4e-5", "--frames", "6", "--quiet"};
  const io::RunDirectory reference{scratch / "reference"};
  const auto words = [&](const io::RunDirectory& out, const char* more) {
    std::vector<std::string> all = {"sim", tiny, "--out", out.root.string()};
    all.insert(all.end(), scene.begin(), scene.end());
    if (more != nullptr) all.emplace_back(more);
    return all;
  };
  ASSERT_EQ(run_duet(words(reference, nullptr)).status, 0);
  int given_up = 0;
  // The signal comes later each time, because programs that are built with sanitizers take long to start.
  for (int i = 0; i < 100 && given_up < 10; ++i) {
    Program program(words(run, "--resume"));
    program.compute_for(0.02 + 0.012 * i);
    program.signal(SIGTERM);
    const Finished stopped = finish(program);
    given_up += contains(stopped.last_line(), " was given up") ? 1 : 0;
    if (stopped.status == 0) break;
    // The status is 143 before the program has come to its first lines.
    ASSERT_TRUE(stopped.status == 130 || stopped.status == 143) << stopped.status << stopped.errors;
  }
  EXPECT_GT(given_up, 0);
  ASSERT_EQ(run_duet(words(run, "--resume")).status, 0);
  for (int frame = 0; frame <= 6; ++frame)
    EXPECT_EQ(io::read_file(run.mesh(frame)), io::read_file(reference.mesh(frame))) << frame;
  EXPECT_EQ(io::read_file(run.checkpoint() / "0006.bin"), io::read_file(reference.checkpoint() / "0006.bin"));
}

}  // namespace
}  // namespace duet::test::interrupt_test
