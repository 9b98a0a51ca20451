// What the README shows works: its scene runs as written, and its links lead somewhere.
#include <regex>

#include "tests/restart/program.h"
#include "tests/support/places.h"
#include <gtest/gtest.h>

#include "sim/io/files.h"
#include "sim/io/run_directory.h"

namespace duet::test {
namespace {

std::string readme() { return io::read_file(source_folder() + "/README.md"); }

TEST(Readme, ItsSceneRuns) {
  const std::string text = readme(), opening = "```toml\n";
  const std::size_t begin = text.find(opening);
  ASSERT_NE(begin, std::string::npos);
  const std::size_t end = text.find("```", begin + opening.size());
  const ScratchFolder scratch;
  io::write_atomically(scratch / "ball.toml",
                       text.substr(begin + opening.size(), end - begin - opening.size()));
  const Finished finished = run_duet({"run", "ball.toml", "--frames", "1", "--quiet", "--set",
                                      "render.width=160", "--set", "render.height=90"},
                                     scratch.path());
  EXPECT_EQ(finished.status, 0) << finished.errors;
  EXPECT_TRUE(fs::exists(scratch / "out/ball/image/0001.png"));
}

TEST(Readme, ItsLinksLeadToFiles) {
  const std::string text = readme();
  const std::regex link(R"(\]\(([^)#:]+)\))");
  int links = 0;
  for (std::sregex_iterator match(text.begin(), text.end(), link), none; match != none; ++match, ++links)
    EXPECT_TRUE(fs::exists(fs::path(source_folder()) / (*match)[1].str())) << (*match)[1];
  EXPECT_GE(links, 2);
}

}  // namespace
}  // namespace duet::test
