#include <string>

#include "tests/unit/tools/vise.h"
#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"

namespace duet::test::volume_notes_test {
namespace {

// Simulates two plates that close on a soft box of 1 m, to a gap of `gap` (m), in half a second.
Finished squeeze(double gap, const std::string& solver, const std::string& of_block) {
  const ScratchFolder folder;
  io::write_atomically(
      folder / "vise.toml",
      "[solver]\n" + solver +
          "\n[materials.rubber]\ndensity = 1000\nyoungs_modulus = 1e5\npoisson_ratio = 0.4\ndamping = "
          "0.02\n[[deformable]]\nname = \"block\"\nshape = { box = [1, 1, 1], cells = [3, 3, 3] }\n"
          "position = [0, 1.5, 0]\nmaterial = \"rubber\"\n" +
          of_block + "\n" + vise_plates(gap));
  return run_duet({"sim", (folder / "vise.toml").string(), "--frames", "13", "--stats-only", "--out",
                   (folder / "run").string()});
}

TEST(VolumeNotes, NameABodyThatIsSqueezedToNothing) {
  const Finished finished = squeeze(0, "", "");
  EXPECT_EQ(finished.status, 0) << finished.errors;
  EXPECT_NE(text_of(finished).find("`block` is squeezed to "), std::string::npos) << text_of(finished);
  EXPECT_NE(finished.last_line().find("`block` squeezed to "), std::string::npos) << finished.last_line();
}

TEST(VolumeNotes, NameAnIncompressibleBodyThatLosesItsVolume) {
  const Finished finished = squeeze(0.2, "integration = \"implicit\"", "incompressible = true");
  EXPECT_EQ(finished.status, 0) << finished.errors;
  EXPECT_NE(text_of(finished).find("`block` is incompressible, but its volume is "), std::string::npos)
      << finished.errors;
  EXPECT_NE(finished.last_line().find("volume of `block` up to "), std::string::npos) << finished.last_line();
}

TEST(VolumeNotes, AreSilentWhereElasticityBearsTheLoad) {
  for (const std::string of_block : {"", "incompressible = true"}) {
    const Finished finished = squeeze(0.7, "", of_block);
    EXPECT_EQ(finished.status, 0) << finished.errors;
    const std::string text = text_of(finished);
    EXPECT_EQ(text.find("volume"), std::string::npos) << text;
    EXPECT_EQ(text.find("inverted"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace duet::test::volume_notes_test
