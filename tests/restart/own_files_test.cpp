// Tests that commands which write a single file replace only files that they wrote.
#include "tests/restart/program.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"

namespace duet::test::own_files_test {
namespace {

class OwnFiles : public testing::Test {
 protected:
  ScratchFolder scratch;

  Finished call(const std::vector<std::string>& words) const { return run_duet(words, scratch.path()); }
  void expect_done(const std::vector<std::string>& words) const {
    const Finished finished = call(words);
    EXPECT_EQ(finished.status, 0) << finished.errors;
  }
  // Checks that a command refuses to replace a file, which stays as it is.
  void expect_refused(const std::vector<std::string>& words, const char* file) const {
    const std::string before = io::read_file(scratch / file);
    const Finished refused = call(words);
    EXPECT_EQ(refused.status, 2) << words[0];
    EXPECT_TRUE(contains(refused.errors, "stays untouched (give another path")) << refused.errors;
    EXPECT_EQ(io::read_file(scratch / file), before);
  }
};

TEST_F(OwnFiles, PreviewReplacesPreviewsAlone) {
  const std::vector<std::string> words = {"preview", tiny, "--out", "photo.png", "--quiet"};
  io::write_atomically(scratch / "photo.png", "\x89PNG of a holiday");
  expect_refused(words, "photo.png");
  fs::remove(scratch / "photo.png");
  expect_done(words);
  expect_done(words);
  ASSERT_EQ(call({"run", tiny, "--frames", "0", "--out", "run", "--quiet"}).status, 0);
  expect_refused({"preview", tiny, "--out", "run/image/0000.png"}, "run/image/0000.png");
}

TEST_F(OwnFiles, DifferencesReplaceNoPictureThatIsCompared) {
  expect_done({"preview", tiny, "--out", "a.png", "--quiet"});
  expect_done({"preview", tiny, "--out", "b.png", "--quiet", "--frame", "2"});
  const std::vector<std::string> loose = {"--max-rmse", "1", "--max-share", "1", "--max-patch", "1000000"};
  const auto compare = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "compare");
    words.insert(words.end(), loose.begin(), loose.end());
    return words;
  };
  expect_refused(compare({"a.png", "b.png", "--difference", "a.png"}), "a.png");
  expect_refused(compare({"a.png", "b.png", "--difference", "./b.png"}), "b.png");
  expect_done(compare({"a.png", "b.png", "--difference", "c.png"}));
  expect_done(compare({"a.png", "b.png", "--difference", "c.png"}));
  expect_refused(compare({"c.png", "b.png", "--difference", "c.png"}), "c.png");
  for (const char* name : {"one", "two"}) {
    io::create_folder(scratch / name);
    fs::copy_file(scratch / "a.png", scratch / name / "a.png");
  }
  expect_refused(compare({"one", "two", "--difference", "two"}), "two/a.png");
  expect_done(compare({"one", "two", "--difference", "seen"}));
}

TEST_F(OwnFiles, TetrahedralizeReplacesItsOwnMeshesAlone) {
  const std::string bracket = source_folder() + "/assets/bracket.obj";
  for (const char* file : {"b.mesh", "b.vtk"}) {
    const std::vector<std::string> words = {"tetrahedralize", bracket, file, "--cells", "8"};
    for (const char* others : {"precious", "MeshVersionFormatted 2\n\nDimension\n3\n\nVertices\n4\n",
                               "# vtk DataFile Version 3.0\nof my thesis\nASCII\n"}) {
      io::write_atomically(scratch / file, others);
      expect_refused(words, file);
    }
    fs::remove(scratch / file);
    expect_done(words);
    expect_done(words);
  }
}

}  // namespace
}  // namespace duet::test::own_files_test
