// Every file of tests/broken has one flaw (several.toml has several). Its first lines say, as "# expect LINE:
// fragment", what the reader must report, and the reader must report nothing else.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/support/places.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/scene/reader/reader.h"

namespace duet::scene::broken_test {
namespace {

namespace fs = std::filesystem;

const fs::path folder = fs::path(test::source_folder()) / "tests" / "broken";

struct Expectation {
  int line;
  std::string fragment;
};

std::vector<Expectation> expectations(const fs::path& file) {
  const std::string mark = "# expect ";
  std::vector<Expectation> found;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line) && line.starts_with(mark);) {
    const auto colon = line.find(": ");
    found.push_back({std::stoi(line.substr(mark.size())), line.substr(colon + 2)});
  }
  return found;
}

std::vector<std::string> broken_scenes() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

class BrokenScene : public testing::TestWithParam<std::string> {};

TEST_P(BrokenScene, IsReportedWithItsPlace) {
  const fs::path file = folder / (GetParam() + ".toml");
  const std::vector<Expectation> expected = expectations(file);
  ASSERT_FALSE(expected.empty()) << "the file does not say what to expect";
  try {
    read(file.string());
    FAIL() << "the scene was accepted";
  } catch (const SceneError& error) {
    EXPECT_EQ(error.status(), ExitStatus::usage);
    const auto& problems = error.problems();
    ASSERT_EQ(problems.size(), expected.size()) << error.what();
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_EQ(problems[i].line, expected[i].line) << problems[i].text();
      EXPECT_EQ(problems[i].column > 0, problems[i].line > 0) << problems[i].text();
      EXPECT_EQ(problems[i].file, file.string());
      EXPECT_NE(problems[i].text().find(expected[i].fragment), std::string::npos)
          << problems[i].text() << "\nlacks: " << expected[i].fragment;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, BrokenScene, testing::ValuesIn(broken_scenes()),
                         [](const auto& scene) { return scene.param; });

}  // namespace
}  // namespace duet::scene::broken_test
