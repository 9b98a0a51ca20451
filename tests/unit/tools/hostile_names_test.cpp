// Tests with names of files, bodies and stages that somebody else chose. They are shown, and nothing in them
// is executed.
#include <algorithm>

#include "tests/restart/program.h"
#include "tests/support/places.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"
#include "sim/io/run_journal.h"

namespace duet::test::hostile_names_test {
namespace {

// This name holds everything that a shell, gnuplot, HTML or a terminal could take for a command.
const std::string hostile = "`touch pwned` $(touch pwned) @x 'a' \"b\"; <b>&amp\\ \x1b[31mred\x07";

bool has_control_characters(const std::string& text) {
  return std::any_of(text.begin(), text.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return (byte < 0x20 && c != '\n' && c != '\t') || byte == 0x7f;
  });
}

void replace(std::string& text, const std::string& before, const std::string& after) {
  for (std::size_t at = 0; (at = text.find(before, at)) != std::string::npos; at += after.size())
    text.replace(at, before.size(), after);
}

class HostileNames : public testing::Test {
 protected:
  ScratchFolder scratch;

  void simulate(const std::string& out, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"sim", tiny, "--frames", "3", "--quiet", "--out", out};
    words.insert(words.end(), more.begin(), more.end());
    const Finished finished = run_duet(words, scratch.path());
    ASSERT_EQ(finished.status, 0) << finished.errors;
  }
  // Returns whether a command in one of the names was run, in whatever folder.
  bool something_ran() const {
    for (const auto& entry : fs::recursive_directory_iterator(scratch.path()))
      if (entry.path().filename() == "pwned") return true;
    return fs::exists("pwned");
  }
};

TEST_F(HostileNames, ReportShowsStagesAndTitlesAndRunsNothing) {
  simulate("run");
  const io::RunDirectory run{scratch / "run"};
  std::string stats = io::read_file(run.stats()), manifest = io::read_file(run.manifest());
  const std::string stage = "\"I.1 advance velocity\":{";
  ASSERT_TRUE(contains(stats, stage));
  // The stage takes half a second, because a stage that takes hardly any time has no area of its own in the
  // chart.
  replace(stats, stage, nlohmann::json(hostile).dump() + ":{\"seconds\":0.5,\"calls\":1},\"unused\":{");
  replace(manifest, "\"Tiny\"", nlohmann::json(hostile).dump());
  io::write_atomically(run.stats(), stats);
  io::write_atomically(run.manifest(), manifest);
  fs::remove(io::journal_path(run.root));  // The journal would tell that the files were changed.

  const Finished finished = run_duet({"report", "run"}, scratch.path());
  ASSERT_EQ(finished.status, 0) << finished.errors;
  EXPECT_FALSE(something_ran());
  const std::string html = io::read_file(run.root / "report/report.html");
  EXPECT_TRUE(contains(html,
                       "`touch pwned` $(touch pwned) @x &#39;a&#39; &quot;b&quot;; &lt;b&gt;&amp;amp\\ "
                       "\\x1b[31mred\\x07"));
  EXPECT_FALSE(contains(html, "<b>"));
  EXPECT_FALSE(has_control_characters(html));
  EXPECT_TRUE(contains(io::read_file(run.root / "report/stages.svg"), "`touch pwned` $(touch pwned) @x"));
}

TEST_F(HostileNames, FoldersAreReportedOnAndRunNothing) {
  for (const std::string& name : {hostile + "\nnext line", std::string("| touch pwned;"),
                                  std::string("< touch pwned"), std::string("-x")}) {
    simulate("./" + name);
    const Finished finished = run_duet({"report", "./" + name}, scratch.path());
    ASSERT_EQ(finished.status, 0) << finished.errors;
    EXPECT_TRUE(fs::exists(scratch.path() / name / "report/report.html"));
    EXPECT_EQ(finished.output.size(), 1U) << "a name with a line's end stays within its line";
    EXPECT_FALSE(has_control_characters(finished.last_line())) << finished.last_line();
    EXPECT_FALSE(something_ran()) << name;
  }
}

TEST_F(HostileNames, VideosAreMadeInSuchFolders) {
  const Finished finished = run_duet({"run", tiny, "--frames", "1", "--quiet", "--set", "render.width=64",
                                      "--set", "render.height=48", "--out", "./%d " + hostile},
                                     scratch.path());
  ASSERT_EQ(finished.status, 0) << finished.errors;
  EXPECT_TRUE(fs::exists(scratch.path() / ("%d " + hostile) / "tiny.mp4")) << finished.last_line();
  EXPECT_FALSE(something_ran());
}

TEST_F(HostileNames, PlotLedgerShowsThemAndRunsNothing) {
  simulate(hostile, {"--ledger"});
  const io::RunDirectory run{scratch.path() / hostile};
  std::string stats = io::read_file(run.stats());
  const std::string stage = "\"IV.2 interpenetration resolution\"";
  ASSERT_TRUE(contains(stats, stage));
  replace(stats, stage, nlohmann::json(hostile + "', system('touch pwned') #").dump());
  io::write_atomically(run.stats(), stats);
  fs::remove(io::journal_path(run.root));  // a forged run, as somebody may send it
  Program program({"./" + hostile}, scratch.path(), source_folder() + "/tools/plot-ledger");
  const Finished finished = finish(program);
  ASSERT_EQ(finished.status, 0) << finished.errors;
  EXPECT_GT(fs::file_size(run.root / "ledger.png"), 1000U);
  EXPECT_FALSE(something_ran());
}

TEST_F(HostileNames, NoCommandPrintsTerminalCommands) {
  const std::string title = nlohmann::json(hostile).dump();
  io::write_atomically(
      scratch / "scene.toml",
      "title = " + title +
          "\n[[rigid]]\nname = \"a\"\nshape = { sphere = 1 }\nmass = 1\n"
          "[[rigid]]\nname = \"b\"\nshape = { sphere = 1 }\nmass = 1\nposition = [0.5, 0, 0]\n"
          "[render]\nwidth = 160\nheight = 90\nsupersampling = 1\n");
  io::write_atomically(scratch.path() / (hostile + ".toml"), io::read_file(scratch / "scene.toml"));
  io::create_folder(scratch / "scenes");
  io::write_atomically(scratch / "scenes/scene.toml", io::read_file(scratch / "scene.toml"));
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"sim", "scene.toml", "--frames", "1"},
        {"sim", "scene.toml", "--frames", "1"},  // This one is refused, because the folder holds a run.
        {"sim", hostile + ".toml", "--frames", "1"},
        {"check", hostile + ".toml"},
        {"explain", hostile + ".toml"},
        {"explain", hostile + ".toml", "--json"},
        {"list"},
        {"new", hostile},
        {"new", hostile},  // This one is refused, because the file exists.
        {"new", "x", "--mesh", hostile},
        {"new", "x", "--template", hostile},
        {"preview", hostile + ".toml"},
        {"preview", "scene.toml", "--out", hostile},
        {"preview", "scene.toml", "--moments", "2", "--frame", "1", "--out", hostile + ".png"},
        {"sim", hostile},
        {"sim", "scene.toml", "--" + hostile},
        {hostile},
        {"render", hostile},
        {"sim", "scene.toml", "--set", hostile},
        {"sim", "scene.toml", "--frames", "1", "--json", "--out", hostile}}) {
    const Finished finished = run_duet(words, scratch.path());
    for (const std::string& line : finished.output) EXPECT_FALSE(has_control_characters(line)) << line;
    EXPECT_FALSE(has_control_characters(finished.errors)) << finished.errors;
  }
  EXPECT_FALSE(something_ran());
}

}  // namespace
}  // namespace duet::test::hostile_names_test
