// Tests of examples, manual pages and completions, which are made from the declarations of the options.
#include <algorithm>
#include <set>

#include "tests/restart/program.h"
#include "tests/support/text.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/files.h"

namespace duet::test::manual_test {
namespace {

// Runs a line of a shell in the folder, with `program` as the first parameter of the shell: $0.
Finished run_shell(const std::string& shell, const std::string& line, const fs::path& folder) {
  Program program({"-c", line, duet_program()}, folder, shell);
  return finish(program);
}

// Returns the names of the commands that `duet --help` lists.
std::vector<std::string> commands() {
  std::vector<std::string> names;
  bool is_listed = false;
  for (const std::string& line : run_duet({"--help"}).output) {
    if (is_listed && line.starts_with("  ") && line.size() > 2 && line[2] != ' ')
      names.push_back(line.substr(2, line.find(' ', 2) - 2));
    is_listed |= line.starts_with("Subcommands:") || line.starts_with("SUBCOMMANDS:");  // CLI11 2.6 shouts
  }
  return names;
}

TEST(Manual, EveryCommandHasExamplesThatParse) {
  const std::vector<std::string> names = commands();
  ASSERT_GE(names.size(), 18U);
  const Finished examples = run_duet({"manual", "--examples"});
  ASSERT_EQ(examples.status, 0) << examples.errors;
  for (const std::string& name : names) {
    EXPECT_TRUE(std::any_of(examples.output.begin(), examples.output.end(), [&](const std::string& line) {
      return line.starts_with("duet " + name + " ") || line == "duet " + name;
    })) << name;
    const Finished help = run_duet({name, "--help"});
    EXPECT_TRUE(std::find(help.output.begin(), help.output.end(), "Examples:") != help.output.end()) << name;
  }
}

TEST(Manual, PagesNameEveryOptionAndRenderWithoutWarnings) {
  const ScratchFolder scratch;
  const Finished written = run_duet({"manual", "--into", scratch.path().string()});
  ASSERT_EQ(written.status, 0) << written.errors;
  const bool has_groff = run_shell("/bin/sh", "command -v groff", scratch.path()).status == 0;
  const std::string run_page = io::read_file(scratch / "share/man/man1/duet-run.1");
  for (const char* part : {"\\-\\-stop\\-after", "\\-\\-set", ".SH EXAMPLES", "\\fBfine\\fR"})
    EXPECT_TRUE(contains(run_page, part)) << part;
  std::vector<std::string> pages = {"duet"};
  for (const std::string& name : commands()) pages.push_back("duet-" + name);
  for (const std::string& page : pages) {
    ASSERT_TRUE(fs::exists(scratch / ("share/man/man1/" + page + ".1"))) << page;
    if (!has_groff) continue;
    const Finished shown = run_shell(
        "/bin/sh", fmt::format("groff -man -Kutf8 -Tutf8 -ww share/man/man1/{}.1", page), scratch.path());
    EXPECT_EQ(shown.status, 0);
    EXPECT_EQ(shown.errors, "") << page;
    EXPECT_GE(shown.output.size(), 20U) << page;
  }
}

TEST(Manual, BashCompletesCommandsOptionsAndValues) {
  const ScratchFolder scratch;
  fs::create_directories(scratch / "out/my-run");
  io::write_atomically(scratch / "out/my-run/manifest.json", "{}");
  io::write_atomically(scratch / "mine.toml", "");
  io::write_atomically(scratch / "notes.txt", "");
  struct Case {
    std::string words;                  // of the command line; the last one is completed
    std::vector<std::string> expected;  // among what is offered
    std::string refused;                // not among it
  };
  for (const Case& one :
       std::vector<Case>{{"duet ex", {"explain", "export"}, "run"},
                         {"duet run --acc", {"--accuracy"}, "--set"},
                         {"duet run stack --accuracy ''", {"draft", "standard", "fine"}, "--out"},
                         {"duet export my-run --to us", {"usd"}, "glb"},
                         {"duet sim --without push", {"push_out"}, "springs"},
                         {"duet new x --template cl", {"cloth"}, "drop"},
                         {"duet run hard/to", {"hard/tower"}, "stack"},
                         {"duet run ''", {"mine.toml", "stack"}, "notes.txt"},
                         {"duet verify my", {"my-run"}, "mine.toml"},
                         {"duet manual stu", {"study"}, "run"}}) {
    // `compopt` complains outside of a completion, which changes nothing.
    const Finished offered = run_shell("/bin/bash",
                                       "source <(\"$0\" manual --shell bash); COMP_WORDS=(" + one.words +
                                           "); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); COMP_WORDS[0]=$0; "
                                           "_duet 2>/dev/null; printf '%s\\n' \"${COMPREPLY[@]}\"",
                                       scratch.path());
    const std::set<std::string> words(offered.output.begin(), offered.output.end());
    for (const std::string& word : one.expected)
      EXPECT_TRUE(words.contains(word)) << one.words << ": " << word;
    EXPECT_FALSE(words.contains(one.refused)) << one.words << ": " << one.refused;
    EXPECT_EQ(offered.errors, "") << one.words;
  }
}

// Shells that are not installed cannot say whether they understand their file.
TEST(Manual, ShellsUnderstandTheirCompletions) {
  const ScratchFolder scratch;
  int shells = 0;
  for (const char* shell : {"bash", "zsh", "fish"}) {
    const Finished text = run_duet({"manual", "--shell", shell});
    ASSERT_EQ(text.status, 0) << text.errors;
    EXPECT_GE(text.output.size(), 100U) << shell;
    if (run_shell("/bin/sh", fmt::format("command -v {}", shell), scratch.path()).status != 0) continue;
    const Finished read = run_shell(
        "/bin/sh", fmt::format("\"$0\" manual --shell {0} > completions && {0} -n completions", shell),
        scratch.path());
    EXPECT_EQ(read.status, 0) << shell << read.errors;
    ++shells;
  }
  EXPECT_GE(shells, 1);
}

TEST(Manual, AnUnknownCommandIsRefusedWithTheNearestOne) {
  const Finished finished = run_duet({"manual", "rnder"});
  EXPECT_EQ(finished.status, 2);
  EXPECT_TRUE(contains(finished.errors, "did you mean `render`?")) << finished.errors;
}

// The installed tree is one folder that can be moved.
TEST(Manual, AnInstalledTreeWorksAfterItIsMoved) {
  const ScratchFolder scratch;
  const std::string build = fs::path(duet_program()).parent_path().string();
  const Finished installed =
      run_shell("/bin/sh", fmt::format("cmake --install '{}' --prefix first", build), scratch.path());
  ASSERT_EQ(installed.status, 0) << installed.errors;
  fs::create_directories(scratch / "elsewhere/empty");
  fs::rename(scratch / "first", scratch / "elsewhere/moved tree");
  const fs::path tree = scratch / "elsewhere/moved tree";
  Program program({"run", "study/top", "--frames", "1", "--quiet", "--set", "render.width=64", "--set",
                   "render.height=36"},
                  scratch / "elsewhere/empty", (tree / "bin/duet").string());
  const Finished finished = finish(program);
  EXPECT_EQ(finished.status, 0) << finished.errors << finished.last_line();
  EXPECT_TRUE(fs::exists(scratch / "elsewhere/empty/out/study/top/image/0001.png"));
  for (const char* file :
       {"share/duet/scenes/stack.toml", "share/duet/scenes/costs.json", "share/duet/assets/knot.obj",
        "share/duet/assets/templates/drop.toml", "share/man/man1/duet.1", "share/man/man1/duet-run.1",
        "share/bash-completion/completions/duet", "share/zsh/site-functions/_duet",
        "share/fish/vendor_completions.d/duet.fish"})
    EXPECT_TRUE(io::holds_bytes(tree / file)) << file;
  EXPECT_FALSE(contains(io::read_file(tree / "share/bash-completion/completions/duet"), build));
}

}  // namespace
}  // namespace duet::test::manual_test
