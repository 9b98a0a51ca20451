// Tests of the parts of a journal, in which programs that draw a run at the same time list their pictures.
#include <csignal>

#include "tests/support/text.h"
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/io/run_check.h"
#include "sim/io/run_directory.h"
#include "sim/io/run_folder.h"
#include "sim/io/run_journal.h"

namespace duet::io::run_journal_parts_test {
namespace {

using test::contains;

class JournalParts : public testing::Test {
 protected:
  ScratchFolder scratch;
  RunDirectory run{scratch.path(), RunJournal::open(scratch.path(), 0)};

  void SetUp() override {
    for (const char* folder : {"mesh", "image"}) create_folder(scratch / folder);
    run.write(run.mesh(0), "a mesh");
  }
  std::string text() const { return read_file(journal_path(run.root)); }
  // Returns the number of parts.
  std::size_t parts() const { return files_in(scratch / "journal").size(); }
  // Opens the run as a program that draws.
  RunDirectory drawing() const {
    RunDirectory opened = open_run(run.root);
    opened.journal->begin_part();
    return opened;
  }
  std::string fault(int frame) const { return RunJournal::read(run.root)->fault(run.image(frame)); }
};

TEST_F(JournalParts, ArePartOfTheJournalAndMergedIntoIt) {
  const std::string before = text();
  const RunDirectory first = drawing(), second = drawing();
  first.write(run.image(0), "a picture");
  second.write(run.image(1), "another picture");
  EXPECT_EQ(text(), before) << "only the holder of the claim appends to the journal";
  EXPECT_EQ(parts(), 2U);
  EXPECT_EQ(check_run(run).whole, 3);
  EXPECT_TRUE(check_run(run).notes.empty());
  write_atomically(run.image(1), "another pictura");
  EXPECT_TRUE(contains(fault(1), "is damaged"));
  first.journal->end_part();
  EXPECT_EQ(parts(), 1U);
  EXPECT_TRUE(contains(text(), "image/0000.png"));
  EXPECT_FALSE(contains(text(), "image/0001.png")) << "its writer goes on";
  second.journal->end_part();
  EXPECT_FALSE(fs::exists(scratch / "journal"));
  EXPECT_FALSE(fs::exists(scratch / "claim"));
  EXPECT_TRUE(contains(fault(1), "is damaged"));
  EXPECT_EQ(fault(0), "");
}

TEST_F(JournalParts, WaitWhileASimulationHoldsTheRun) {
  {
    const RunClaim simulation(run.root, "duet sim");
    const RunDirectory one = drawing();
    one.write(run.image(0), "a picture");
    one.journal->end_part();
    EXPECT_EQ(parts(), 1U);
    EXPECT_EQ(fault(0), "");
    EXPECT_EQ(check_run(run).whole, 2);
  }
  static_cast<void>(RunJournal::open(run.root, 0));
  EXPECT_EQ(parts(), 0U);
  EXPECT_TRUE(contains(text(), "image/0000.png"));
}

// A task of a farm that was taken for dead may go on and draw the frames of the one that took its place.
TEST_F(JournalParts, APictureMayBeAsEitherOfTwoProgramsListsIt) {
  const RunDirectory first = drawing(), second = drawing();
  first.write(run.image(0), "by one");
  second.write(run.image(0), "by the other");
  EXPECT_EQ(fault(0), "");
  write_atomically(run.image(0), "by one");
  EXPECT_EQ(fault(0), "");
  write_atomically(run.image(0), "by neither");
  EXPECT_TRUE(contains(fault(0), "is damaged"));
}

// Whether a program is killed before or after it renames a picture, the picture is whole.
TEST_F(JournalParts, AKillBetweenTwoWritesLeavesNoDamage) {
  run.write(run.image(0), "old looks");
  const RunDirectory one = drawing();
  one.journal->replace(run.image(0), mark_of("new looks"));
  EXPECT_EQ(fault(0), "");
  write_atomically(run.image(0), "new looks");
  EXPECT_EQ(fault(0), "");
  write_atomically(run.image(0), "no looks.");
  EXPECT_TRUE(contains(fault(0), "is damaged"));
}

TEST_F(JournalParts, ThoseOfKilledProgramsAreMerged) {
  const pid_t child = ::fork();
  if (child == 0) {
    drawing().write(run.image(0), "a picture");
    std::raise(SIGKILL);
  }
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(parts(), 1U);
  EXPECT_TRUE(RunJournal::writers_of_parts(run.root).empty());
  static_cast<void>(RunJournal::open(run.root, 0));
  EXPECT_EQ(parts(), 0U);
  EXPECT_TRUE(contains(text(), "image/0000.png"));
}

// A simulation that continues a run removes what killed programs left, and nothing of those that draw
// meanwhile.
TEST_F(JournalParts, TemporaryFilesOfTheirWritersStay) {
  const RunDirectory one = drawing();
  const std::string left = run.image(0).string() + temporary_mark;
  const fs::path ours = left + std::to_string(::getpid()) + "-7", others = left + "99999999-7";
  for (const fs::path& path : {ours, others}) write_atomically(path, "half a pict");
  write_atomically(run.scene(), "");
  continue_run(run, {}, "");
  EXPECT_TRUE(fs::exists(ours));
  EXPECT_FALSE(fs::exists(others));
}

TEST_F(JournalParts, ARunAnewForgetsThem) {
  const RunDirectory one = drawing();
  one.write(run.image(0), "a picture");
  clear_run(run);
  EXPECT_EQ(parts(), 0U);
  EXPECT_EQ(RunJournal::read(run.root), nullptr);
}

}  // namespace
}  // namespace duet::io::run_journal_parts_test
