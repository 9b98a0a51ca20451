// Tests that the lines of --json have the keys that tools/README.md promises.
#include <map>
#include <regex>
#include <set>

#include "tests/restart/program.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"

namespace duet::test::json_test {
namespace {

// Returns the words in backquotes of a text.
std::set<std::string> quoted_words(const std::string& text) {
  const std::regex quoted("`([a-z_]+)`");
  std::set<std::string> words;
  for (std::sregex_iterator match(text.begin(), text.end(), quoted), none; match != none; ++match)
    words.insert((*match)[1]);
  return words;
}

// Returns the keys of each event in the table of the section "JSON".
std::map<std::string, std::set<std::string>> promised_keys() {
  const std::string page = io::read_file(source_folder() + "/tools/README.md");
  const std::string section = page.substr(page.find("\n## JSON\n"));
  const std::regex row("\n\\| `([a-z]+)` \\| [^|]* \\| ([^|]*) \\|");
  std::map<std::string, std::set<std::string>> keys;
  for (std::sregex_iterator match(section.begin(), section.end(), row), none; match != none; ++match)
    keys[(*match)[1]] = quoted_words((*match)[2]);
  return keys;
}

TEST(Json, EventsHaveTheKeysThatThePagePromises) {
  const std::map<std::string, std::set<std::string>> promised = promised_keys();
  ASSERT_GE(promised.size(), 8U);
  const ScratchFolder scratch;
  const std::string run = (scratch / "run").string();
  std::set<std::string> seen;
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"run", tiny, "--frames", "2", "--out", run, "--set", "render.width=64",
                                 "--set", "render.height=36", "--json"},
        {"run", tiny, "--frames", "2", "--out", run, "--json"},  // refused, because the folder holds a run
        {"export", run, "--to", "transforms", "--json"},
        {"compare", run + "/image/0000.png", run + "/image/0001.png", "--json"}}) {
    const Finished finished = run_duet(words, scratch.path());
    ASSERT_FALSE(finished.output.empty());
    for (const std::string& line : finished.output) {
      const nlohmann::json object = nlohmann::json::parse(line);
      const std::string event = object.at("event");
      seen.insert(event);
      ASSERT_TRUE(promised.contains(event)) << line;
      for (const auto& [key, value] : object.items())
        EXPECT_TRUE(key == "event" || promised.at(event).contains(key)) << key << " of " << line;
      // An error is there after errors alone; the words for outcomes are values.
      for (const std::string& key : promised.at(event))
        EXPECT_TRUE(object.contains(key) || event == "outcome") << key << " is missing in " << line;
    }
    EXPECT_EQ(nlohmann::json::parse(finished.last_line()).at("event"), "outcome");
  }
  // Notes depend on what is installed.
  for (const char* event : {"start", "frame", "drawn", "exported", "pair", "outcome"})
    EXPECT_TRUE(seen.contains(event)) << event;
}

}  // namespace
}  // namespace duet::test::json_test
