#include "sim/io/run_claim.h"

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

#include "tests/support/text.h"
#include <fcntl.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"

namespace duet::io::run_claim_test {
namespace {

using test::contains;

constexpr ClaimTimes quick = {0.02, 0.2};

// Writes the claim of a process into the folder.
void forge(const fs::path& root, int number, const ProcessName& process) {
  create_folder(root / "claim");
  const nlohmann::ordered_json claim = {{"holder", nlohmann::ordered_json::parse(process_json(process))},
                                        {"work", "duet sim"},
                                        {"since", "2026-11-28 12:00:00"}};
  write_atomically(root / "claim" / ("000" + std::to_string(number) + ".json"), claim.dump() + "\n");
}

// Returns the name of a process that has ended.
ProcessName ended_process() {
  ProcessName process = this_process();
  process.process = ::fork();
  if (process.process == 0) ::_exit(0);
  ::waitpid(static_cast<pid_t>(process.process), nullptr, 0);
  return process;
}

ProcessName foreign_process() { return {"node7", "another boot", 4711, 12}; }

TEST(RunClaim, OneProgramHoldsItAndNothingStays) {
  const ScratchFolder scratch;
  {
    const RunClaim claim(scratch.path(), "duet sim");
    EXPECT_NO_THROW(claim.require_held());
    try {
      const RunClaim second(scratch.path(), "duet run");
      FAIL() << "two programs hold the claim";
    } catch (const FileError& error) {
      EXPECT_TRUE(contains(error.what(), "duet sim, process " + std::to_string(::getpid()) + " on "))
          << error.what();
    }
    EXPECT_EQ(RunClaim::holder(scratch.path())->process, this_process());
  }
  EXPECT_FALSE(RunClaim::holder(scratch.path()).has_value());
  EXPECT_TRUE(fs::is_empty(scratch.path()));
}

TEST(RunClaim, AProcessIsToldFromALaterOneOfItsNumber) {
  const ProcessName self = this_process();
  EXPECT_EQ(life_of(self), Life::alive);
  ProcessName earlier = self;
  --earlier.start;
  EXPECT_EQ(life_of(earlier), Life::ended);
  EXPECT_EQ(life_of(ended_process()), Life::ended);
  EXPECT_EQ(life_of(foreign_process()), Life::unknown);
  EXPECT_EQ(read_process(process_json(self)), self);
  for (const char* text : {"", "[]", "{}", R"({"host":1})"})
    EXPECT_FALSE(read_process(text).has_value()) << text;
}

// A process that has ended on this machine is known at once, whatever the times are.
TEST(RunClaim, IsTakenFromAProcessThatHasEnded) {
  const ScratchFolder scratch;
  forge(scratch.path(), 5, ended_process());
  EXPECT_FALSE(RunClaim::holder(scratch.path()).has_value());
  const RunClaim claim(scratch.path(), "duet sim", 0, {1000, 10'000});
  EXPECT_TRUE(fs::exists(scratch / "claim/0006.json"));
  EXPECT_FALSE(fs::exists(scratch / "claim/0005.json"));
}

TEST(RunClaim, IsTakenFromASilentProgramElsewhere) {
  const ScratchFolder scratch;
  forge(scratch.path(), 1, foreign_process());
  EXPECT_EQ(RunClaim::holder(scratch.path())->process.host, "node7");
  const RunClaim claim(scratch.path(), "duet sim", 0, quick);
  EXPECT_EQ(RunClaim::holder(scratch.path())->process, this_process());
}

TEST(RunClaim, IsNotTakenFromAProgramElsewhereThatLives) {
  const ScratchFolder scratch;
  forge(scratch.path(), 1, foreign_process());
  std::atomic<bool> ended{false};
  std::thread other([&] {
    while (!ended) {
      ::utimensat(AT_FDCWD, (scratch / "claim/0001.json").c_str(), nullptr, 0);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  EXPECT_THROW(RunClaim(scratch.path(), "duet sim", 0, {0.1, 20}), FileError);
  ended = true;
  other.join();
  EXPECT_EQ(RunClaim::holder(scratch.path())->process.host, "node7");
}

TEST(RunClaim, AHolderGivesSignsOfLife) {
  const ScratchFolder scratch;
  const RunClaim claim(scratch.path(), "duet sim", 0, quick);
  const fs::path file = scratch / "claim/0001.json";
  const auto before = fs::last_write_time(file);
  for (int i = 0; i < 1000 && fs::last_write_time(file) == before; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_NE(fs::last_write_time(file), before);
}

TEST(RunClaim, AHolderThatLostItNoticesBeforeItWrites) {
  const ScratchFolder scratch;
  const RunClaim claim(scratch.path(), "duet sim", 0, quick);
  forge(scratch.path(), 2, foreign_process());
  remove_file(scratch / "claim/0001.json");  // what the other program does
  EXPECT_THROW(claim.require_held(), FileError);
}

TEST(RunClaim, AFileThatNamesNoHolderIsJudgedByItsSilence) {
  const ScratchFolder scratch;
  create_folder(scratch / "claim");
  write_atomically(scratch / "claim/0001.json", "{\"holder\":");
  EXPECT_TRUE(RunClaim::holder(scratch.path()).has_value());
  EXPECT_NO_THROW(RunClaim(scratch.path(), "duet sim", 0, quick));
}

TEST(RunClaim, WaitsForTheHolder) {
  const ScratchFolder scratch;
  auto first = std::make_unique<RunClaim>(scratch.path(), "duet sim");
  std::thread releasing([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    first.reset();
  });
  EXPECT_NO_THROW(RunClaim(scratch.path(), "duet sim", 100));
  releasing.join();
}

// Eight threads take and release the claim again and again, at first from a dead process.
TEST(RunClaim, TwoNeverHoldIt) {
  const ScratchFolder scratch;
  forge(scratch.path(), 1, ended_process());
  std::atomic<int> inside{0}, most{0}, taken{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 25; ++i) try {
          const RunClaim claim(scratch.path(), "duet sim");
          most = std::max(most.load(), ++inside);
          std::this_thread::yield();
          --inside;
          ++taken;
        } catch (const FileError&) {
        }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(most, 1);
  EXPECT_GT(taken, 0);
  EXPECT_FALSE(fs::exists(scratch / "claim"));
}

}  // namespace
}  // namespace duet::io::run_claim_test
