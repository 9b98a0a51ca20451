#include <string>

#include "tests/unit/tools/vise.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"

namespace duet::test::overlap_notes_test {
namespace {

// Returns a scene in which two plates close on a box of 1 m, to a gap of `gap` (m), in half a second.
std::string vise(double gap) {
  return "[[rigid]]\nname = \"block\"\nshape = { box = [1, 1, 1] }\nposition = [0, 1.5, 0]\nmass = 1000\n" +
         vise_plates(gap);
}

Finished simulate(const ScratchFolder& folder, double gap) {
  io::write_atomically(folder / "vise.toml", vise(gap));
  return run_duet({"sim", (folder / "vise.toml").string(), "--frames", "10", "--stats-only", "--out",
                   (folder / "run").string()});
}

// No motion can avoid the overlap of a rigid box in a vise that is too narrow for it: the program says so.
TEST(OverlapNotes, NameTheBodyThatAViseCrushes) {
  const ScratchFolder folder;
  const Finished finished = simulate(folder, 0.5);
  EXPECT_EQ(finished.status, 0) << finished.errors;
  EXPECT_NE(text_of(finished).find("`block` lies "), std::string::npos) << text_of(finished);
  EXPECT_NE(finished.last_line().find("deep in `"), std::string::npos) << finished.last_line();
}

TEST(OverlapNotes, AreSilentWhereBodiesOnlyTouch) {
  const ScratchFolder folder;
  const Finished finished = simulate(folder, 1);
  EXPECT_EQ(finished.status, 0) << finished.errors;
  EXPECT_EQ(text_of(finished).find("deep in `"), std::string::npos) << finished.last_line();
}

}  // namespace
}  // namespace duet::test::overlap_notes_test
