// Tests of what commands made of a run: it goes when the run is replaced, and nothing else does.
#include "tests/restart/simulated_run.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"

namespace duet::test::products_test {
namespace {

class Products : public SimulatedRun {
 protected:
  const fs::path exported = run.root / "export", page = run.root / "view.html",
                 report = run.root / "report" / "report.html";

  void call(const std::vector<std::string>& words) const {
    const Finished finished = run_duet(words);
    ASSERT_EQ(finished.status, 0) << words[0] << finished.errors;
  }
  // Simulates four frames, and makes exports, page and report of them.
  void make() const {
    const std::string folder = run.root.string();
    simulate(tiny, {"--frames", "4"});
    for (const char* format : {"obj", "pc2", "usd", "glb"})
      call({"export", folder, "--to", format, "--quiet"});
    call({"view", folder, "--quiet"});
    call({"report", folder});
  }
  Finished replace() const {
    return run_duet({"sim", tiny, "--out", run.root.string(), "--frames", "2", "--overwrite", "--quiet"});
  }
};

TEST_F(Products, GoWithTheRunThatTheyShow) {
  make();
  ASSERT_TRUE(fs::exists(exported / "obj/0004.obj") && fs::exists(page) && fs::exists(report));
  const Finished replaced = replace();
  EXPECT_EQ(replaced.status, 0) << replaced.errors;
  EXPECT_EQ(replaced.output.size(), 1U) << "nothing is left to be noted";
  EXPECT_FALSE(fs::exists(exported));
  EXPECT_FALSE(fs::exists(page));
  EXPECT_FALSE(fs::exists(report.parent_path()));
}

TEST_F(Products, FilesOfOthersStayAndAreNamed) {
  make();
  const fs::path others[] = {exported / "obj/notes.txt", exported / "tiny.blend", run.root / "report/why.md",
                             exported / "mine/0001.obj"};
  io::create_folder(exported / "mine");
  for (const fs::path& file : others) io::write_atomically(file, "work of days");
  io::write_atomically(page, "<p>a page of my own");
  const Finished replaced =
      run_duet({"sim", tiny, "--out", run.root.string(), "--frames", "2", "--overwrite"});
  EXPECT_EQ(replaced.status, 0) << replaced.errors;
  for (const fs::path& file : others) EXPECT_EQ(io::read_file(file), "work of days");
  EXPECT_EQ(io::read_file(page), "<p>a page of my own");
  EXPECT_FALSE(fs::exists(exported / "obj/0004.obj"));
  EXPECT_FALSE(fs::exists(report));
  bool is_noted = false;
  for (const std::string& line : replaced.output)
    is_noted |= contains(line, "and 4 more stay, and may show the run that was replaced");
  EXPECT_TRUE(is_noted);
}

TEST_F(Products, StayWhenARunIsContinuedOrRefused) {
  make();
  EXPECT_EQ(run_duet({"sim", tiny, "--out", run.root.string(), "--frames", "2"}).status, 2);
  call({"sim", tiny, "--out", run.root.string(), "--frames", "5", "--resume", "--quiet"});
  EXPECT_TRUE(fs::exists(exported / "obj/0004.obj") && fs::exists(page) && fs::exists(report));
}

}  // namespace
}  // namespace duet::test::products_test
