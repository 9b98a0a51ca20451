// Tests of `duet new` and `duet preview`: a new scene takes one command, and its picture another.
#include <csignal>
#include <regex>
#include <set>
#include <sstream>

#include "tests/restart/program.h"
#include "tests/support/places.h"
#include "tests/support/text.h"
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "render/picture.h"
#include "sim/base/files.h"

namespace duet::test::new_test {
namespace {

const std::vector<std::string> templates = {"drop", "stack", "cloth", "rope", "creature", "chain"};

// Returns everything below the folder, by its path relative to the folder.
std::set<std::string> files_below(const fs::path& folder) {
  std::set<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    files.insert(entry.path().lexically_relative(folder).string());
  return files;
}

// Checks that the first occurrence of each key has a comment, so that the template explains all of its keys,
// and that lines and files are short.
void expect_comments(const std::string& name, const std::string& text) {
  const std::regex key("^([a-z_0-9]+) = ");
  std::set<std::string> explained;
  std::istringstream lines(text);
  int count = 0;
  for (std::string line; std::getline(lines, line); ++count) {
    EXPECT_LE(line.size(), 120U) << name << ": " << line;
    std::smatch found;
    if (!std::regex_search(line, found, key)) continue;
    const bool has_comment = contains(line, "# ");
    EXPECT_TRUE(has_comment || explained.contains(found[1])) << name << ": " << line;
    explained.insert(found[1]);
  }
  EXPECT_GE(count, 30) << name;
  EXPECT_LE(count, 100) << name;
}

class New : public testing::Test {
 protected:
  ScratchFolder scratch;
  Finished run(const std::vector<std::string>& words) const { return run_duet(words, scratch.path()); }

  // Checks that the command fails with this status and message, and leaves no new files.
  void expect_refused(const std::vector<std::string>& words, int status, const std::string& message) const {
    const std::set<std::string> before = files_below(scratch.path());
    const Finished finished = run(words);
    EXPECT_EQ(finished.status, status) << finished.errors;
    EXPECT_TRUE(contains(finished.errors, message)) << finished.errors;
    EXPECT_EQ(files_below(scratch.path()), before) << message;
  }
};

class NewTemplate : public New, public testing::WithParamInterface<std::string> {};

TEST_P(NewTemplate, IsExplainedCheckedAndSimulated) {
  const Finished made = run({"new", "mine", "--template", GetParam()});
  ASSERT_EQ(made.status, 0) << made.errors;
  EXPECT_TRUE(contains(made.last_line(), "`duet preview mine.toml`")) << made.last_line();
  EXPECT_TRUE(contains(made.last_line(), "`duet run mine.toml`")) << made.last_line();
  expect_comments(GetParam(), io::read_file(scratch / "mine.toml"));
  const Finished checked = run({"check", "mine.toml"});
  EXPECT_EQ(checked.status, 0);
  EXPECT_EQ(checked.output, std::vector<std::string>{"mine.toml: ok"}) << "without a word of overlaps";
  const Finished simulated = run({"sim", "mine.toml", "--frames", "2", "--accuracy", "draft", "--quiet"});
  EXPECT_EQ(simulated.status, 0) << simulated.errors;
}

INSTANTIATE_TEST_SUITE_P(All, NewTemplate, testing::ValuesIn(templates),
                         [](const auto& test) { return test.param; });

// Returns the text with what the comment of a line says is to stand in place of it: "# try `x = 1` in place
// of this line". The text is empty if no comment says so.
std::string with_other_line(const std::string& text) {
  const std::regex hint("\n[^\n]*#[^\n]*`([^`\n]+)` in place of this line");
  std::smatch found;
  if (!std::regex_search(text, found, hint)) return {};
  return found.prefix().str() + "\n" + found[1].str() + found.suffix().str();
}

TEST_P(NewTemplate, TakesTheLinesThatItsCommentsOffer) {
  ASSERT_EQ(run({"new", "mine", "--template", GetParam()}).status, 0);
  const std::string other = with_other_line(io::read_file(scratch / "mine.toml"));
  EXPECT_EQ(other.empty(), GetParam() != "rope" && GetParam() != "cloth");
  if (other.empty()) return;
  io::write_atomically(scratch / "other.toml", other);
  const Finished checked = run({"check", "other.toml"});
  EXPECT_EQ(checked.status, 0) << fmt::format("{}", fmt::join(checked.output, "\n"));
}

// The comments of the template of --mesh say how to make the mesh a rigid body.
TEST_F(New, AMeshBecomesAHardBodyAsTheCommentsSay) {
  fs::copy_file(fs::path(source_folder()) / "assets/bracket.obj", scratch / "hero.obj");
  ASSERT_EQ(run({"new", "hero", "--mesh", "hero.obj"}).status, 0);
  std::string text = with_other_line(io::read_file(scratch / "hero.toml"));
  ASSERT_TRUE(contains(text, "\n[[deformable]]  "));
  ASSERT_TRUE(contains(text, "# for a hard body: [[rigid]], and leave out [materials.soft]\n"));
  text.replace(text.find("[[deformable]]"), 14, "[[rigid]]");
  const std::size_t material = text.find("[materials.soft]");
  text.erase(material, text.find("\n[", material) - material);
  io::write_atomically(scratch / "hard.toml", text);
  const Finished checked = run({"check", "hard.toml"});
  EXPECT_EQ(checked.status, 0) << fmt::format("{}", fmt::join(checked.output, "\n"));
}

TEST_F(New, FallsBackToDropAndKeepsTheEnding) {
  ASSERT_EQ(run({"new", "a.toml"}).status, 0);
  ASSERT_EQ(run({"new", "b", "--template", "drop"}).status, 0);
  EXPECT_EQ(files_below(scratch.path()), (std::set<std::string>{"a.toml", "b.toml"}));
  EXPECT_EQ(io::read_file(scratch / "a.toml"), io::read_file(scratch / "b.toml"));
}

TEST_F(New, RefusesWithAReason) {
  fs::create_directory(scratch / "folder.toml");
  expect_refused({"new", "x", "--template", "clot"}, 2, "did you mean `cloth`?");
  expect_refused({"new", "x", "--template", "mesh"}, 2, "--mesh FILE");
  expect_refused({"new", ""}, 2, "names no file");
  expect_refused({"new", "there/"}, 2, "names no file");
  expect_refused({"new", "folder"}, 2, "is a folder");
  expect_refused({"new", "no such/x"}, 4, "`mkdir -p 'no such'`");
  expect_refused({"new", "x", "--template", "drop", "--mesh", "a.obj"}, 2, "--mesh");
}

TEST_F(New, ReplacesAFileOnlyWhenAsked) {
  io::write_atomically(scratch / "x.toml", "mine");
  expect_refused({"new", "x"}, 2, "--overwrite");
  EXPECT_EQ(io::read_file(scratch / "x.toml"), "mine");
  EXPECT_EQ(run({"new", "x", "--overwrite"}).status, 0);
  EXPECT_NE(io::read_file(scratch / "x.toml"), "mine");
}

TEST_F(New, AFolderThatCannotBeWrittenHasStatusFour) {
  // Even the superuser, who may write anywhere, can make no files there.
  expect_refused({"new", "/proc/x"}, 4, "cannot");
  if (::geteuid() == 0) return;
  fs::create_directory(scratch / "closed");
  ::chmod((scratch / "closed").c_str(), 0555);
  expect_refused({"new", "closed/x"}, 4, "cannot");
}

TEST_F(New, AMeshOfAnySizeFallsOnTheStep) {
  // The mesh is a tetrahedron that is 1000 units wide, away from its origin, and beside the folder of the
  // scene.
  fs::create_directory(scratch / "scenes of \"mine\"");
  io::write_atomically(scratch / "a mesh.obj",
                       "v 5000 0 0\nv 6000 0 0\nv 5500 0 900\nv 5500 800 400\n"
                       "f 1 2 3\nf 1 4 2\nf 2 4 3\nf 3 4 1\n");
  const std::string scene = "scenes of \"mine\"/t.toml";
  const Finished made = run({"new", scene, "--mesh", "a mesh.obj"});
  ASSERT_EQ(made.status, 0) << made.errors;
  EXPECT_TRUE(contains(made.last_line(), "`duet run 'scenes of \"mine\"/t.toml'`")) << made.last_line();
  const std::string text = io::read_file(scratch / scene);
  EXPECT_TRUE(contains(text, "\nmesh = \"../a mesh.obj\" ")) << text;
  EXPECT_TRUE(contains(text, "\nscale = 0.001 ")) << text;
  EXPECT_TRUE(contains(text, "\nplace = [-5.25, 0.7, -0.45] ")) << text;
  expect_comments("mesh", text);
  const Finished checked = run({"check", scene});
  EXPECT_EQ(checked.output, std::vector<std::string>{scene + ": ok"});
  const Finished simulated =
      run({"sim", scene, "--frames", "2", "--accuracy", "draft", "--quiet", "--out", "run"});
  EXPECT_EQ(simulated.status, 0) << simulated.errors;
}

TEST_F(New, RefusesAMeshThatNoSceneAccepts) {
  io::write_atomically(scratch / "open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  io::write_atomically(scratch / "text.obj", "no mesh\n");
  expect_refused({"new", "x", "--mesh", "open.obj"}, 2, "open.obj");
  expect_refused({"new", "x", "--mesh", "text.obj"}, 4, "text.obj");
  expect_refused({"new", "x", "--mesh", "missing.obj"}, 4, "missing.obj");
}

class Preview : public New {
 protected:
  // Checks that there is a picture of this size with many colors.
  void expect_picture(const fs::path& path, int width, int height) const {
    const render::Picture picture = render::read_picture(path);
    EXPECT_EQ(picture.width, width);
    EXPECT_EQ(picture.height, height);
    EXPECT_GT(std::set<unsigned char>(picture.rgb.begin(), picture.rgb.end()).size(), 20U);
  }
};

TEST_F(Preview, DrawsTheStartAndNothingElse) {
  const Finished drawn = run({"preview", tiny});
  ASSERT_EQ(drawn.status, 0) << drawn.errors;
  EXPECT_TRUE(contains(drawn.last_line(), "out/tiny-preview.png, 320 x 180 pixels")) << drawn.last_line();
  EXPECT_EQ(files_below(scratch.path()), (std::set<std::string>{"out", "out/tiny-preview.png"}));
  expect_picture(scratch / "out/tiny-preview.png", 320, 180);
}

TEST_F(Preview, FollowsFrameSizeAndChanges) {
  ASSERT_EQ(run({"preview", tiny, "--out", "start.png"}).status, 0);
  ASSERT_EQ(run({"preview", tiny, "--out", "later.png", "--frame", "8", "--accuracy", "draft"}).status, 0);
  ASSERT_EQ(run({"preview", tiny, "--out", "moved.png", "--set", "rigid.ball.position=[0.5,1,0]"}).status, 0);
  const std::string start = io::read_file(scratch / "start.png");
  EXPECT_NE(io::read_file(scratch / "later.png"), start);
  EXPECT_NE(io::read_file(scratch / "moved.png"), start);
  ASSERT_EQ(run({"preview", tiny, "--out", "start.png", "--width", "160"}).status, 0)
      << "previews are replaced";
  expect_picture(scratch / "start.png", 160, 90);
  ASSERT_EQ(run({"preview", tiny, "--out", "start.png", "--set", "render.width=96"}).status, 0);
  expect_picture(scratch / "start.png", 96, 180);
}

TEST_F(Preview, ShowsTheFrameThatARunDraws) {
  ASSERT_EQ(run({"run", tiny, "--frames", "2", "--out", "out/tiny", "--quiet"}).status, 0);
  const Finished drawn = run({"preview", "out/tiny/", "--frame", "2", "--width", "64", "--height", "36"});
  ASSERT_EQ(drawn.status, 0) << drawn.errors;
  EXPECT_TRUE(contains(drawn.last_line(), "out/tiny-preview.png")) << drawn.last_line();
  const render::Picture preview = render::read_picture(scratch / "out/tiny-preview.png");
  const render::Picture image = render::read_picture(scratch / "out/tiny/image/0002.png");
  ASSERT_EQ(preview.rgb.size(), image.rgb.size());
  std::size_t different = 0;  // The meshes of the run are rounded.
  for (std::size_t i = 0; i < image.rgb.size(); ++i)
    if (std::abs(preview.rgb[i] - image.rgb[i]) > 2) ++different;
  EXPECT_LE(different, image.rgb.size() / 100);
}

TEST_F(Preview, MomentsMakeASheet) {
  const Finished drawn =
      run({"preview", tiny, "--moments", "6", "--frame", "10", "--width", "64", "--height", "36"});
  ASSERT_EQ(drawn.status, 0) << drawn.errors;
  const fs::path path = scratch / "out/tiny-preview.png";
  expect_picture(path, 3 * 64 + 2 * 4, 2 * 36 + 4);
  const render::Picture sheet = render::read_picture(path);
  const auto level = [&](int x, int y) {
    return sheet.rgb[static_cast<std::size_t>(3 * (y * sheet.width + x))];
  };
  for (int y = 0; y < sheet.height; ++y)
    for (int x = 64; x < 68; ++x) EXPECT_EQ(level(x, y), 255) << "a gap";
  // The first picture of the sheet is that of frame 0, and the last one that of frame 10.
  for (const auto& [frame, left, top] : {std::array{0, 0, 0}, std::array{10, 136, 40}}) {
    ASSERT_EQ(run({"preview", tiny, "--frame", std::to_string(frame), "--width", "64", "--height", "36",
                   "--out", "one.png"})
                  .status,
              0);
    const render::Picture one = render::read_picture(scratch / "one.png");
    bool same = true;
    for (int y = 0; y < 36; ++y)
      for (int x = 0; x < 64; ++x)
        same = same && level(left + x, top + y) == one.rgb[static_cast<std::size_t>(3 * (y * 64 + x))];
    EXPECT_TRUE(same) << frame;
  }
}

TEST_F(Preview, RefusesAndLeavesNothing) {
  fs::create_directory(scratch / "folder.png");
  expect_refused({"preview", "tiyn.toml"}, 2, "no such scene");
  expect_refused({"preview", tiny, "--moments", "1"}, 2, "--moments");
  expect_refused({"preview", tiny, "--moments", "17"}, 2, "--moments");
  expect_refused({"preview", tiny, "--moments", "5", "--frame", "3"}, 2, "smaller number");
  expect_refused({"preview", tiny, "--frame", "-1"}, 2, "--frame");
  expect_refused({"preview", tiny, "--width", "5"}, 2, "--width");
  expect_refused({"preview", tiny, "--out", "picture.jpg"}, 2, ".png");
  expect_refused({"preview", tiny, "--out", "folder.png"}, 2, "is a folder");
  expect_refused({"preview", tiny, "--out", "no/picture.png"}, 4, "`mkdir -p no`");
  expect_refused({"preview", tiny, "--set", "rigid.ball.mas=3"}, 2, "mass");
  expect_refused({"preview", tiny, "--moments", "16", "--width", "8000", "--height", "8000"}, 2, "too large");
  expect_refused({"preview", tiny, "--frame", "5", "--set", "solver.max_substeps=1"}, 3, "max_substeps");
}

TEST_F(Preview, CtrlCEndsItWithoutAPicture) {
  Program program({"preview", tiny, "--frame", "100000"}, scratch.path());
  for (int lines = 0; lines < 3; ++lines) ASSERT_TRUE(program.line());
  program.signal(SIGINT);
  const Finished finished = finish(program);
  EXPECT_EQ(finished.status, 130);
  EXPECT_TRUE(contains(finished.last_line(), "no picture was written")) << finished.last_line();
  EXPECT_TRUE(files_below(scratch.path()).empty());
}

}  // namespace
}  // namespace duet::test::new_test
