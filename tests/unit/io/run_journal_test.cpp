#include "sim/io/run_journal.h"

#include <atomic>
#include <thread>

#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/io/line_log.h"
#include "sim/io/run_check.h"
#include "sim/io/run_directory.h"

namespace duet::io::run_journal_test {
namespace {

using test::contains;
using State = RunJournal::Entry::State;

class Journal : public testing::Test {
 protected:
  ScratchFolder scratch;
  RunDirectory run{scratch.path(), RunJournal::open(scratch.path(), 0)};

  void SetUp() override {
    for (const char* folder : {"mesh", "levelset", "image", "checkpoint"}) create_folder(scratch / folder);
  }
  std::string text() const { return read_file(journal_path(run.root)); }
  // Returns the journal as another program reads it.
  std::shared_ptr<RunJournal> reread() const { return RunJournal::read(run.root); }
};

TEST_F(Journal, ListsWhatIsWrittenAndSaysWhatIsDamaged) {
  run.write(run.mesh(0), "a mesh");
  run.write(run.mesh(1), "another mesh");
  EXPECT_TRUE(reread()->faults().empty());
  EXPECT_EQ(reread()->entry(run.mesh(0))->mark, mark_of("a mesh"));
  EXPECT_EQ(reread()->fault(run.mesh(0)), "");
  EXPECT_EQ(run.read(run.mesh(0)), "a mesh");
  write_atomically(run.mesh(0), "a mess");
  EXPECT_TRUE(contains(reread()->fault(run.mesh(0)), "is damaged: its 6 bytes have the hash "));
  EXPECT_THROW(run.read(run.mesh(0)), FileError);
  EXPECT_THROW(run.require_whole(run.mesh(0)), FileError);
  write_atomically(run.mesh(0), "");
  EXPECT_EQ(reread()->fault(run.mesh(0)), "is damaged: it has 0 bytes, and 6 were written");
  fs::remove(run.mesh(0));
  EXPECT_EQ(reread()->fault(run.mesh(0)), "is missing");
  EXPECT_EQ(reread()->fault(run.mesh(1)), "");
  EXPECT_EQ(reread()->fault(run.mesh(2)), "") << "not listed";
}

// While a file changes, the journal lists it as changing and does not check it. A program that is killed
// between two calls thus leaves no file that seems damaged.
TEST_F(Journal, FilesThatChangeAreNotCheckedMeanwhile) {
  run.write(run.mesh(0), "old");
  const std::string listed = text();
  run.write(run.mesh(0), "old");
  EXPECT_EQ(text(), listed) << "the same bytes are no news";
  run.journal->replace(run.mesh(0));
  EXPECT_EQ(reread()->entry(run.mesh(0))->state, State::replacing);
  EXPECT_EQ(reread()->fault(run.mesh(0)), "");
  write_atomically(run.mesh(0), "new");
  EXPECT_EQ(reread()->fault(run.mesh(0)), "");
  run.journal->list(run.mesh(0), mark_of("new"));
  EXPECT_EQ(reread()->fault(run.mesh(0)), "");
  run.journal->remove(run.mesh(0));
  EXPECT_EQ(reread()->entry(run.mesh(0))->state, State::removed);
  EXPECT_EQ(reread()->fault(run.mesh(0)), "") << "still there";
  fs::remove(run.mesh(0));
  EXPECT_EQ(reread()->fault(run.mesh(0)), "");
  EXPECT_TRUE(check_run(run).faults.empty());
}

TEST_F(Journal, GrowingFilesAreCheckedAsFarAsTheyAreListed) {
  {
    LineLog log(run, run.stats(), -1);
    log.append(R"({"frame":0})");
    log.list();
    log.append(R"({"frame":1})");  // The program is killed here, before the line is listed.
  }
  EXPECT_EQ(reread()->fault(run.stats()), "");
  const std::string whole = read_file(run.stats());
  write_atomically(run.stats(), whole.substr(0, whole.find('\n')));
  EXPECT_TRUE(contains(reread()->fault(run.stats()), "is damaged")) << "a byte of the first line is gone";
  std::string flipped = whole;
  flipped[3] ^= 1;
  write_atomically(run.stats(), flipped);
  EXPECT_TRUE(contains(reread()->fault(run.stats()), "is damaged"));
  write_atomically(run.stats(), whole);
  { const LineLog resumed(run, run.stats(), 0); }
  EXPECT_EQ(read_file(run.stats()), "{\"frame\":0}\n");
  EXPECT_EQ(reread()->fault(run.stats()), "");
  EXPECT_EQ(reread()->entry(run.stats())->mark.bytes, 12U);
}

TEST_F(Journal, DamageOfAGrowingFileIsRememberedAsItGrowsOn) {
  LineLog log(run, run.stats(), -1);
  log.append(R"({"frame":0})");
  log.list();
  run.journal->flaw(run.stats());
  log.append(R"({"frame":1})");
  log.list();
  EXPECT_TRUE(contains(reread()->fault(run.stats()), "was damaged"));
  EXPECT_EQ(check_run(run).faults.size(), 1U);
}

TEST_F(Journal, ALineThatWasNotWrittenToItsEndIsCutOff) {
  run.write(run.mesh(0), "a mesh");
  const std::string whole = text();
  for (std::size_t size = whole.find('\n') + 1; size < whole.size(); ++size) {
    run.journal.reset();
    write_atomically(journal_path(run.root), whole.substr(0, size));
    EXPECT_TRUE(reread()->faults().empty()) << size;
    run.journal = RunJournal::open(run.root, 1);
    run.write(run.mesh(1), "another");
    EXPECT_TRUE(reread()->faults().empty()) << size;
    EXPECT_EQ(reread()->fault(run.mesh(1)), "");
    EXPECT_EQ(reread()->first_frame(), 0);
  }
}

// Whichever bit of the journal flips, the check reports a fault: no listed file becomes an unchecked one
// without notice.
TEST_F(Journal, DamageOfTheJournalIsNamed) {
  run.write(run.mesh(0), "a mesh");
  run.write(run.mesh(1), "another mesh");
  run.write(run.root / "checkpoint/0001.bin", "a state");
  ASSERT_TRUE(check_run(run).faults.empty());
  ASSERT_EQ(check_run(run).whole, 3);
  const std::string whole = text();
  const std::size_t first_frame = whole.find("\"first_frame\":0") + 14;
  for (std::size_t i = 0; i < whole.size(); ++i)
    for (const int bit : {0, 1, 6}) {
      if (i == first_frame) continue;  // Another first frame is as good for files that are listed.
      std::string damaged = whole;
      damaged[i] ^= static_cast<char>(1 << bit);
      write_atomically(journal_path(run.root), damaged);
      const RunCheck check = check_run(run);
      // Without its end, the line of the newest checkpoint is torn, which is a note.
      const bool is_last_end = i + 1 == whole.size();
      EXPECT_FALSE(check.faults.empty() && !(is_last_end && !check.notes.empty())) << damaged;
    }
  // Lines that are lost at the end leave more unlisted files than a killed program does.
  write_atomically(journal_path(run.root), whole.substr(0, whole.find('\n') + 1));
  EXPECT_EQ(check_run(run).faults.size(), 3U);
  write_atomically(journal_path(run.root), whole + R"({"file":"film.mp4")");
  EXPECT_TRUE(check_run(run).faults.empty());
  ASSERT_EQ(check_run(run).notes.size(), 1U);
  EXPECT_TRUE(contains(check_run(run).notes[0], "its last line has no end"));
  for (const std::string& forged : {std::string(R"({"file":"../../secret","bytes":1,"hash":"0"})"),
                                    std::string(R"({"file":"/etc/passwd",)"),
                                    std::string(R"({"file":"mesh/0000.obj","bytes":-1,"hash":"0"})"),
                                    std::string(R"({"file":"mesh/0000.obj","bytes":1e300,"hash":"0"})"),
                                    std::string(R"({"file":"mesh/0000.obj","state":"unknown"})"),
                                    std::string("[]"), std::string(1000, '[')}) {
    write_atomically(journal_path(run.root), whole + forged + '\n');
    ASSERT_EQ(check_run(run).faults.size(), 1U) << forged;
    EXPECT_TRUE(contains(check_run(run).faults[0], "journal.jsonl: line 5 is damaged")) << forged;
  }
  for (const char* text : {"", "\n", "no journal\n"}) {
    write_atomically(journal_path(run.root), text);
    EXPECT_FALSE(check_run(run).faults.empty()) << text;
  }
  fs::remove(journal_path(run.root));
  EXPECT_EQ(check_run(run).faults.size(), 1U);
}

// A simulation anew removes the journal, at any moment of a check.
TEST_F(Journal, MayVanishWhileItsRunIsChecked) {
  run.write(run.mesh(0), "a mesh");
  write_atomically(run.mesh(0), "a mess");
  run.journal.reset();
  std::atomic<bool> stop = false;
  std::thread other([&] {
    while (!stop) {
      fs::rename(journal_path(run.root), scratch / "aside");
      fs::rename(scratch / "aside", journal_path(run.root));
    }
  });
  std::string unexpected;
  for (int i = 0; i < 2000 && unexpected.empty(); ++i) try {
      const RunCheck check = check_run(run);
      for (const std::string& fault : check.faults)
        if (!contains(fault, "0000.obj: is damaged") && !contains(fault, "journal.jsonl: is missing"))
          unexpected = fault;
      if (check.faults.size() != 1) unexpected += fmt::format("{} faults", check.faults.size());
    } catch (const std::exception& error) {
      unexpected = error.what();
    }
  stop = true;
  other.join();
  EXPECT_EQ(unexpected, "");
}

// A program without journals began the run. Its frames are not checked, and the check notes this.
TEST_F(Journal, FilesBeforeItsFirstFrameAreANote) {
  run.journal.reset();
  fs::remove(journal_path(run.root));
  run.write(run.mesh(0), "a mesh");
  run.journal = RunJournal::open(run.root, 1);
  run.write(run.mesh(1), "another mesh");
  run.write(run.root / "checkpoint/0001.bin", "a state");
  const RunCheck check = check_run(run);
  EXPECT_TRUE(check.faults.empty());
  ASSERT_EQ(check.notes.size(), 1U);
  EXPECT_TRUE(contains(check.notes[0], "from frame 1 on; 1 of earlier frames are not checked"))
      << check.notes[0];
}

}  // namespace
}  // namespace duet::io::run_journal_test
