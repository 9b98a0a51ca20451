// Tests that every damaged or lost file of a run is named, by `duet verify`, by every command that reads it,
// and by --resume.
#include <algorithm>
#include <csignal>
#include <functional>
#include <map>

#include "tests/restart/program.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/io/run_check.h"
#include "sim/io/run_journal.h"

namespace duet::test::verify_test {
namespace {

class Verify : public testing::Test {
 protected:
  ScratchFolder scratch;
  io::RunDirectory run{scratch / "run"};

  Finished duet(std::vector<std::string> words) const {
    if (words[0] == "sim" || words[0] == "run") {
      for (const char* word :
           {tiny.c_str(), "--set", "render.width=64", "--set", "render.height=48", "--out", "run"})
        words.emplace_back(word);
    }
    if (words[0] != "verify" && words[0] != "report") words.emplace_back("--quiet");
    return run_duet(words, scratch.path());
  }
  void simulate(const std::vector<std::string>& words) const {
    const Finished finished = duet(words);
    ASSERT_EQ(finished.status, 0) << finished.errors;
  }
  // Returns the paths of all files of the run but the journal, relative to its folder.
  std::vector<std::string> files() const {
    std::vector<std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(run.root))
      if (entry.is_regular_file() && entry.path() != io::journal_path(run.root))
        found.push_back(entry.path().lexically_relative(run.root).generic_string());
    return found;
  }
  // Flips a bit of the file, at the fraction `where` of its length.
  void flip(const fs::path& path, double where = 0.5) const {
    std::string bytes = io::read_file(path);
    bytes[static_cast<std::size_t>(where * static_cast<double>(bytes.size() - 1))] ^= 4;
    io::write_atomically(path, bytes);
  }
  void expect_refused(const std::vector<std::string>& words, const std::vector<std::string>& said) const {
    const Finished refused = duet(words);
    EXPECT_EQ(refused.status, 4) << words[0];
    for (const std::string& part : said)
      EXPECT_TRUE(contains(refused.errors, part)) << part << ": " << refused.errors;
  }
};

TEST_F(Verify, EveryFileIsListedAndEveryDamageIsNamed) {
  simulate({"run", "--frames", "3", "--hash-stages"});
  const Finished whole = duet({"verify", "run"});
  ASSERT_EQ(whole.status, 0) << whole.errors;
  EXPECT_TRUE(contains(whole.last_line(), std::to_string(files().size()) + " files of run are as written"))
      << whole.last_line() << ", " << files().size();
  EXPECT_GE(files().size(), 4U * 3 + 2 + 4);
  EXPECT_TRUE(io::check_run(run).notes.empty());
  using Damage = std::function<void(const fs::path&)>;
  const std::vector<Damage> damages = {
      [&](const fs::path& path) { flip(path, 0); },
      [&](const fs::path& path) { flip(path, 0.5); },
      [&](const fs::path& path) { flip(path, 1); },
      [](const fs::path& path) { fs::resize_file(path, fs::file_size(path) - 1); },
      [](const fs::path& path) { fs::resize_file(path, 0); },
      [](const fs::path& path) { fs::remove(path); },
      [](const fs::path& path) {
        fs::remove(path);
        fs::create_directory(path);
      }};
  for (const std::string& name : files()) {
    const fs::path path = run.root / name;
    const std::string bytes = io::read_file(path);
    for (std::size_t i = 0; i < damages.size(); ++i) {
      damages[i](path);
      const io::RunCheck check = io::check_run(run);
      ASSERT_EQ(check.faults.size(), 1U) << name << ", damage " << i;
      EXPECT_TRUE(contains(check.faults[0], name)) << check.faults[0];
      fs::remove(path);
      io::write_atomically(path, bytes);
    }
    EXPECT_TRUE(io::check_run(run).faults.empty()) << name;
  }
  flip(run.mesh(1));
  fs::remove(run.image(2));
  expect_refused({"verify", "run"}, {"run/mesh/0001.obj: is damaged", "run/image/0002.png: is missing"});
}

// Whenever a run is killed, its files are not taken for damaged, and a resumed run is whole.
TEST_F(Verify, AKilledRunHasNoDamage) {
  const std::vector<std::string> words = {"sim", tiny, "--out", run.root.string(), "--json", "--resume"};
  for (int kill = 0; kill < 12; ++kill) {
    Program program(words);
    for (int line = 0; line <= kill % 4; ++line) program.line();
    program.compute_for(0.0007 * kill);
    program.signal(SIGKILL);
    finish(program);
    if (!fs::exists(io::journal_path(run.root))) continue;
    const io::RunCheck check = io::check_run(run);
    EXPECT_TRUE(check.faults.empty() || check.whole == 0) << check.faults[0];
  }
  const Finished resumed = run_duet(words);
  EXPECT_EQ(resumed.status, 0) << resumed.errors;
  const Finished verified = duet({"verify", "run"});
  EXPECT_EQ(verified.status, 0) << verified.errors;
  EXPECT_EQ(verified.output.size(), 1U) << "nothing is left unchecked";
}

// Files that are named as those of a run are its own: one that the journal does not know is a fault, also if
// it stands alone. Other files are the user's.
TEST_F(Verify, FilesOfFramesThatTheRunLacksAreNamed) {
  simulate({"run", "--frames", "2"});
  for (const char* own : {"notes.txt", "mesh/my.txt", "values/x.npy", "image/best.png"})
    io::write_atomically(run.root / own, "mine");
  const Finished whole = duet({"verify", "run"});
  EXPECT_EQ(whole.status, 0) << whole.errors;
  EXPECT_EQ(whole.output.size(), 1U);
  for (const char* name : {"mesh/0099.obj", "values/0004.npy", "image/0099.png", "levelset/0005.vdb"}) {
    io::write_atomically(run.root / name, "of another program");
    expect_refused({"verify", "run"}, {std::string("run/") + name + ": is not in the journal"});
    fs::remove(run.root / name);
  }
  io::write_atomically(run.mesh(3), "a frame in hand when the program was killed");
  EXPECT_EQ(duet({"verify", "run"}).status, 0);
}

TEST_F(Verify, ReadersRefuseWhatIsDamaged) {
  simulate({"run", "--frames", "4"});
  const std::string mesh = io::read_file(run.mesh(2)), stats = io::read_file(run.stats());
  // A number with another digit still makes a valid OBJ file, so that only the hash can tell.
  std::string other = mesh;
  const std::size_t digit = other.find_first_of("123456", other.find("\nv "));
  other[digit] ^= 1;
  io::write_atomically(run.mesh(2), other);
  expect_refused({"render", "run"}, {"run/mesh/0002.obj", "is damaged", "duet verify"});
  expect_refused({"render", "run", "--frames", "2"}, {"run/mesh/0002.obj", "is damaged"});
  simulate({"render", "run", "--frames", "1"});
  fs::remove(run.mesh(2));
  expect_refused({"render", "run"}, {"run/mesh/0002.obj", "is missing"});
  io::write_atomically(run.mesh(2), mesh);
  simulate({"render", "run"});
  std::string changed = stats;
  changed[changed.find("\"kinetic\":") + 10] ^= 1;
  io::write_atomically(run.stats(), changed);
  expect_refused({"report", "run"}, {"run/stats.jsonl", "is damaged"});
  io::write_atomically(run.stats(), stats);
  std::string scene = io::read_file(run.scene());
  io::write_atomically(run.scene(), scene + "\n# a word more\n");
  expect_refused({"render", "run"}, {"run/scene.toml", "is damaged"});
}

// Resuming names lost frames, both at once and in later checks, and does not pass over them silently.
TEST_F(Verify, ResumeNamesWhatIsLostAndGoesOn) {
  simulate({"sim", "--frames", "5"});
  flip(run.mesh(2));
  fs::remove(run.level_set(3));
  std::string stats = io::read_file(run.stats());
  stats.erase(0, stats.find('\n') + 1);
  io::write_atomically(run.stats(), stats);
  const Finished resumed = duet({"sim", "--frames", "8", "--resume"});
  EXPECT_EQ(resumed.status, 4);
  EXPECT_TRUE(contains(resumed.last_line(), "frames 0 to 8")) << resumed.last_line();
  EXPECT_TRUE(contains(resumed.last_line(), "4 files are damaged or missing")) << resumed.last_line();
  EXPECT_TRUE(fs::exists(run.mesh(8)));
  expect_refused({"verify", "run"},
                 {"mesh/0002.obj: is damaged", "levelset/0003.vdb: is missing", "stats.jsonl: was damaged"});
  expect_refused({"report", "run"}, {"run/stats.jsonl"});
  fs::remove(io::journal_path(run.root));
  expect_refused({"report", "run"}, {"stats.jsonl", "lacks frame 0"});
}

TEST_F(Verify, DamagedPicturesAreDrawnAgain) {
  simulate({"run", "--frames", "2"});
  const std::string picture = io::read_file(run.image(1));
  flip(run.image(1));
  fs::remove(run.image(2));
  simulate({"run", "--frames", "3", "--resume"});
  EXPECT_EQ(io::read_file(run.image(1)), picture);
  EXPECT_EQ(duet({"verify", "run"}).status, 0);
}

// A run of a program without journals can be continued, and `duet verify` says that its first frames are not
// checked.
TEST_F(Verify, ARunWithoutAJournalGetsOne) {
  simulate({"sim", "--frames", "2"});
  fs::remove(io::journal_path(run.root));
  expect_refused({"verify", "run"}, {"journal.jsonl: is missing"});
  simulate({"sim", "--frames", "4", "--resume"});
  const Finished verified = duet({"verify", "run"});
  EXPECT_EQ(verified.status, 0) << verified.errors;
  EXPECT_TRUE(contains(verified.output.at(0), "from frame 3 on")) << verified.output[0];
  simulate({"sim", "--frames", "1", "--overwrite"});
  EXPECT_EQ(duet({"verify", "run"}).output.size(), 1U);
}

}  // namespace
}  // namespace duet::test::verify_test
