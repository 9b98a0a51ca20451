#include "sim/base/scratch_folder.h"

#include "tests/support/environment.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"

namespace duet::test::scratch_folder_test {
namespace {

TEST(ScratchFolder, NamesAFolderForTemporaryFilesThatIsMissing) {
  const Environment environment("TMPDIR", "/nonexistent/folder");
  try {
    const ScratchFolder folder;
    FAIL() << folder.path();
  } catch (const FileError& error) {
    EXPECT_TRUE(contains(error.what(), "/nonexistent/folder: is no folder")) << error.what();
    EXPECT_TRUE(contains(error.what(), "set TMPDIR to another folder")) << error.what();
  }
}

}  // namespace
}  // namespace duet::test::scratch_folder_test
