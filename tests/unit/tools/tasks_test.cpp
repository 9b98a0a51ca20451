// Tests that the commands of scenes/TASKS.md work as they stand.
#include "tests/restart/program.h"
#include "tests/support/places.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/io/run_directory.h"

namespace duet::test::tasks_test {
namespace {

// Returns the blocks of commands of a page.
std::vector<std::string> commands_of(const std::string& page) {
  const std::string text = io::read_file(source_folder() + "/" + page), fence = "```sh\n";
  std::vector<std::string> blocks;
  for (std::size_t at = text.find(fence); at != std::string::npos; at = text.find(fence, at + 1)) {
    const std::size_t begin = at + fence.size();
    blocks.push_back(text.substr(begin, text.find("```", begin) - begin));
  }
  return blocks;
}

// Pictures are small and the jelly is coarse: how they look does not matter here.
TEST(Tasks, CommandsOfThePageWorkAsTheyStand) {
  const std::vector<std::string> blocks = commands_of("scenes/TASKS.md");
  ASSERT_EQ(blocks.size(), 7U) << "one to begin with, and one for each task";
  const ScratchFolder scratch;
  fs::create_directory(scratch / "build");
  io::write_atomically(scratch / "build/duet", "#!/bin/sh\nexec \"" + duet_program() + "\" \"$@\"\n");
  fs::permissions(scratch / "build/duet", fs::perms::owner_all);
  for (const std::string& block : blocks) {
    std::string script = "set -e\n" + block;
    if (&block == &blocks.front())
      script +=
          "printf '[render]\\nwidth = 160\\nheight = 90\\nsupersampling = 1\\n' >> ball.toml\n"
          "sed -i 's/cells = .5, 5, 5./cells = [2, 2, 2]/' ball.toml\n";
    Program program({"-c", script}, scratch.path(), "/bin/bash");
    const Finished finished = finish(program);
    EXPECT_EQ(finished.status, 0) << block << finished.errors << finished.last_line();
  }
  EXPECT_TRUE(fs::exists(io::RunDirectory{scratch / "out/shot"}.image(8)));
  EXPECT_TRUE(fs::exists(scratch / "out/draft/report/report.html"));
}

}  // namespace
}  // namespace duet::test::tasks_test
