// Tests that the pages of documentation are true: their scenes run as written, and their links lead
// somewhere.
#include <algorithm>
#include <cctype>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>

#include "tests/restart/program.h"
#include "tests/support/places.h"
#include "tests/support/text.h"
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"

namespace duet::test::readme_test {
namespace {

const std::vector<std::string> pages = {"README.md",
                                        "sim/README.md",
                                        "sim/LIMITS.md",
                                        "sim/step/README.md",
                                        "scenes/README.md",
                                        "scenes/TASKS.md",
                                        "render/README.md",
                                        "tools/README.md",
                                        "tests/README.md",
                                        "tests/RESULTS.md",
                                        "tests/PROTOCOL.md",
                                        "assets/README.md",
                                        "tests/hashes/README.md",
                                        ".github/CONTRIBUTING.md",
                                        ".github/CHANGELOG.md"};

std::string text_of(const fs::path& page) {
  return io::read_file((fs::path(source_folder()) / page).string());
}

// Returns the whole scenes of a page, which are its blocks of TOML that begin with a title.
std::vector<std::string> scenes_of(const std::string& page) {
  const std::string text = text_of(page), fence = "```toml\n", start = fence + "title";
  std::vector<std::string> scenes;
  for (std::size_t at = text.find(start); at != std::string::npos; at = text.find(start, at + 1)) {
    const std::size_t begin = at + fence.size();
    scenes.push_back(text.substr(begin, text.find("```", begin) - begin));
  }
  return scenes;
}

// Returns the anchor of a heading, as GitHub makes it.
std::string anchor_of(const std::string& heading) {
  std::string anchor;
  for (const char c : heading)
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_')
      anchor += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    else if (c == ' ')
      anchor += '-';
  return anchor;
}

bool has_heading(const fs::path& page, const std::string& anchor) {
  std::istringstream lines(text_of(page));
  for (std::string line; std::getline(lines, line);) {
    const std::size_t marks = line.find_first_not_of('#');
    if (marks != 0 && marks != std::string::npos && line[marks] == ' ' &&
        anchor_of(line.substr(marks + 1)) == anchor)
      return true;
  }
  return false;
}

TEST(Readme, ItsSceneRuns) {
  const std::vector<std::string> scenes = scenes_of("README.md");
  ASSERT_EQ(scenes.size(), 1U);
  const ScratchFolder scratch;
  io::write_atomically(scratch / "ball.toml", scenes.front());
  const Finished finished =
      run_duet({"run", "ball.toml", "--frames", "1", "--quiet", "--set", "render.width=160", "--set",
                "render.height=90", "--set", "render.supersampling=1"},
               scratch.path());
  EXPECT_EQ(finished.status, 0) << finished.errors;
  EXPECT_TRUE(fs::exists(scratch / "out/ball/image/0001.png"));
}

TEST(Readme, ScenesOfTheTutorialRun) {
  const std::vector<std::string> scenes = scenes_of("scenes/README.md");
  ASSERT_EQ(scenes.size(), 6U) << "five of the tutorial, and one of an own mesh";
  for (const std::string& scene : scenes) {
    const ScratchFolder scratch;
    io::write_atomically(scratch / "lesson.toml", scene);
    fs::copy_file(fs::path(source_folder()) / "assets/bracket.obj", scratch / "hero.obj");
    const Finished finished = run_duet({"sim", "lesson.toml", "--frames", "1", "--quiet"}, scratch.path());
    EXPECT_EQ(finished.status, 0) << scene << finished.errors;
    EXPECT_TRUE(fs::exists(scratch / "out/lesson/mesh/0001.obj"));
  }
}

// Returns the arguments of all commands `duet run FILE --set ...` of a page.
std::vector<std::vector<std::string>> settings_of(const std::string& page, const std::string& scene) {
  const std::string text = text_of(page);
  const std::regex command("duet run " + scene + "((\\s+--set\\s+[^\\s`]+)+)");
  std::vector<std::vector<std::string>> settings;
  for (std::sregex_iterator match(text.begin(), text.end(), command), none; match != none; ++match) {
    std::istringstream words((*match)[1]);
    settings.emplace_back(std::istream_iterator<std::string>(words), std::istream_iterator<std::string>());
  }
  return settings;
}

// The settings that the tutorial tells to try make scenes without overlaps.
TEST(Readme, SettingsOfTheTutorialWork) {
  const std::string page = "scenes/README.md", scene = scenes_of(page).at(4);
  const std::vector<std::vector<std::string>> settings = settings_of(page, "pairs\\.toml");
  ASSERT_EQ(settings.size(), 1U);
  const ScratchFolder scratch;
  io::write_atomically(scratch / "pairs.toml", scene);
  for (const std::string count : {"", "10", "12"}) {
    std::vector<std::string> arguments = {"check", "pairs.toml"};
    if (count.empty())
      arguments.insert(arguments.end(), settings[0].begin(), settings[0].end());
    else
      arguments.insert(arguments.end(), {"--set", "parameters.count=" + count});
    const Finished finished = run_duet(arguments, scratch.path());
    EXPECT_EQ(finished.status, 0) << finished.errors;
    ASSERT_EQ(finished.output.size(), 1U) << fmt::format("{}", fmt::join(finished.output, "\n"));
    EXPECT_EQ(finished.output[0], "pairs.toml: ok");
  }
}

// The page about the scene language lists every key that the program reads.
TEST(Readme, TheLanguageListsEveryKey) {
  const std::string text = text_of("scenes/README.md");
  const std::string listed = text.substr(text.find("## Key reference"));
  const Finished reference = run_duet({"check", "--reference"});
  ASSERT_EQ(reference.status, 0) << reference.errors;
  const std::regex key("^  (?:[a-z0-9_]+\\.)*([a-z0-9_]+)(?:  | (?:number|text|table)).*");
  int keys = 0;
  for (const std::string& line : reference.output) {
    std::smatch match;
    // Lines with the word `key` are the heads of tables.
    if (!std::regex_match(line, match, key) || match[1] == "key") continue;
    ++keys;
    EXPECT_TRUE(contains(listed, fmt::format("`{}`", match[1].str()))) << line;
  }
  EXPECT_GT(keys, 150);
}

TEST(Readme, LinksOfAllPagesLeadToFilesAndHeadings) {
  const std::regex link(R"re((\]\(|src=")([^)":#]*)(#[^)"]+)?[)"])re");
  int links = 0;
  for (const std::string& page : pages) {
    const std::string text = text_of(page);
    for (std::sregex_iterator match(text.begin(), text.end(), link), none; match != none; ++match, ++links) {
      const std::string path = (*match)[2], anchor = (*match)[3];
      const fs::path target = path.empty() ? fs::path(page) : fs::path(page).parent_path() / path;
      EXPECT_TRUE(fs::exists(fs::path(source_folder()) / target)) << page << ": " << match->str();
      if (anchor.empty() || target.extension() != ".md") continue;
      EXPECT_TRUE(has_heading(target, anchor.substr(1))) << page << ": " << match->str();
    }
  }
  EXPECT_GE(links, 200);
}

// The drawing of the map has the arrows of the rules by which folders include each other.
TEST(Readme, DrawsTheMapByTheRulesOfTheRooms) {
  const std::string page = text_of("sim/README.md"), rules = text_of("sim/rooms.cmake");
  const auto node = [](std::string room) {
    const std::string name = room;
    std::replace(room.begin(), room.end(), '/', '_');
    return room == name ? name : fmt::format("{}[{}]", room, name);
  };
  std::string arrows = "graph LR\n";
  const std::regex rule("set\\(below_([^ )]+)([^)]*)\\)");
  for (std::sregex_iterator match(rules.begin(), rules.end(), rule), none; match != none; ++match) {
    std::istringstream below((*match)[2]);
    for (std::string room; below >> room;)
      arrows += fmt::format("  {} --> {}\n", node(room), node((*match)[1]));
  }
  EXPECT_TRUE(contains(page, "```mermaid\n" + arrows + "```")) << arrows;
}

// Returns the words in backquotes in a cell of a table.
std::vector<std::string> words_of(const std::string& cell) {
  const std::regex word("`([^`]+)`");
  std::vector<std::string> words;
  for (std::sregex_iterator match(cell.begin(), cell.end(), word), none; match != none; ++match)
    words.push_back((*match)[1]);
  return words;
}

// Every module of the simulator has a unit test of its name, or a row in the table of tests/README.md whose
// tests exist.
TEST(Readme, SaysWhereEveryModuleIsTested) {
  const fs::path root = source_folder();
  std::set<std::string> listed;
  std::istringstream lines(text_of("tests/README.md"));
  const std::regex row("\\| ([a-z_/]+) \\| (`[^|]+`) \\| (`[^|]+`) \\|");
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (!std::regex_match(line, match, row) || !fs::is_directory(root / "sim" / match[1].str())) continue;
    for (const std::string& module : words_of(match[2])) {
      const std::string path = match[1].str() + "/" + module;
      EXPECT_TRUE(fs::exists(root / "sim" / (path + ".h")) || fs::exists(root / "sim" / (path + ".cpp")))
          << path << " is no module";
      EXPECT_FALSE(fs::exists(root / "tests/unit" / (path + "_test.cpp")))
          << path << " has a test of its name";
      listed.insert(path);
    }
    for (const std::string& test : words_of(match[3]))
      EXPECT_TRUE(fs::exists(root / "tests" / test)) << test << " does not exist";
  }
  int files = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / "sim")) {
    if (entry.path().extension() != ".h" && entry.path().extension() != ".cpp") continue;
    const std::string path = fs::relative(entry.path(), root / "sim").replace_extension().generic_string();
    EXPECT_TRUE(listed.contains(path) || fs::exists(root / "tests/unit" / (path + "_test.cpp")))
        << "sim/" << path << " needs tests/unit/" << path << "_test.cpp, or a row in tests/README.md";
    ++files;
  }
  EXPECT_GT(files, 400);
}

TEST(Readme, IsShortAndLinksToThePageOfEveryFolder) {
  const std::string text = text_of("README.md");
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 250);
  for (const char* page : {"sim/README.md", "sim/step/README.md", "sim/LIMITS.md", "scenes/README.md",
                           "render/README.md", "tools/README.md", "tests/README.md", "tests/RESULTS.md"})
    EXPECT_NE(text.find(std::string("](") + page), std::string::npos) << page;
}

}  // namespace
}  // namespace duet::test::readme_test
