#include "sim/io/checkpoint.h"

#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"

namespace duet::io::checkpoint_test {
namespace {

class CheckpointTest : public testing::Test {
 protected:
  static constexpr std::uint64_t scene = 42;
  ScratchFolder scratch;
  RunDirectory run{scratch.path()};

  void SetUp() override {
    create_folder(run.checkpoint());
    for (int frame = 0; frame < 5; ++frame) write_checkpoint(run, scene, {frame, state_of(frame)});
  }
  static std::vector<unsigned char> state_of(int frame) {
    return std::vector<unsigned char>(100, static_cast<unsigned char>(frame));
  }
};

TEST_F(CheckpointTest, TheNewestIsFoundAndTwoAreKept) {
  const CheckpointSearch search = find_checkpoint(run, scene);
  ASSERT_TRUE(search.found);
  EXPECT_EQ(search.found->frame, 4);
  EXPECT_EQ(search.found->state, state_of(4));
  EXPECT_TRUE(search.faults.empty());
  EXPECT_TRUE(fs::exists(checkpoint_path(run, 3)));
  EXPECT_FALSE(fs::exists(checkpoint_path(run, 2)));
}

TEST_F(CheckpointTest, EveryDamagedByteIsNoticed) {
  const fs::path newest = checkpoint_path(run, 4);
  const std::string whole = read_file(newest);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] = static_cast<char>(damaged[i] ^ 0x10);
    write_atomically(newest, damaged);
    const CheckpointSearch search = find_checkpoint(run, scene);
    ASSERT_TRUE(search.found) << "byte " << i;
    EXPECT_EQ(search.found->frame, 3) << "byte " << i;
    ASSERT_EQ(search.faults.size(), 1U);
    EXPECT_NE(search.faults[0].find("0004.bin"), std::string::npos) << search.faults[0];
  }
}

TEST_F(CheckpointTest, EveryTruncationIsNoticed) {
  const fs::path newest = checkpoint_path(run, 4);
  const std::string whole = read_file(newest);
  for (std::size_t size = 0; size < whole.size(); ++size) {
    write_atomically(newest, whole.substr(0, size));
    ASSERT_EQ(find_checkpoint(run, scene).found->frame, 3) << size << " bytes";
  }
}

TEST_F(CheckpointTest, AnotherFramesFileUnderThisNameIsPassedOver) {
  fs::copy_file(checkpoint_path(run, 3), checkpoint_path(run, 9));
  const CheckpointSearch search = find_checkpoint(run, scene);
  EXPECT_EQ(search.found->frame, 4);
  EXPECT_NE(search.faults.at(0).find("holds frame 3"), std::string::npos);
}

TEST_F(CheckpointTest, AnotherScenesCheckpointIsForeign) {
  const CheckpointSearch search = find_checkpoint(run, scene + 1);
  EXPECT_FALSE(search.found);
  EXPECT_TRUE(search.foreign);
  EXPECT_EQ(search.faults.size(), 2U);
}

TEST_F(CheckpointTest, TheNumericsThatComputedItAreKept) {
  EXPECT_EQ(find_checkpoint(run, scene).found->numerics, numerics_version);
  write_checkpoint(run, scene, {5, state_of(5), numerics_version + 1});
  const CheckpointSearch search = find_checkpoint(run, scene);
  ASSERT_TRUE(search.found);
  EXPECT_EQ(search.found->frame, 5);
  EXPECT_EQ(search.found->numerics, numerics_version + 1);
  EXPECT_TRUE(search.faults.empty());
}

// A checkpoint of another format version is reported as such and not as damaged. Its file may be shorter than
// the header of this version.
TEST_F(CheckpointTest, AnotherFormatIsNoDamage) {
  for (const int frame : {3, 4}) {
    std::string bytes = read_file(checkpoint_path(run, frame)).substr(0, frame == 3 ? 1000 : 20);
    bytes[8] = 5;  // The number of the format follows the mark of eight bytes.
    write_atomically(checkpoint_path(run, frame), bytes);
  }
  const CheckpointSearch search = find_checkpoint(run, scene);
  EXPECT_FALSE(search.found);
  EXPECT_FALSE(search.foreign);
  EXPECT_TRUE(search.other_format);
  ASSERT_EQ(search.faults.size(), 2U);
  EXPECT_NE(search.faults[0].find("has format 5"), std::string::npos) << search.faults[0];
}

TEST_F(CheckpointTest, NothingIsFoundWhereNothingIs) {
  const CheckpointSearch search = find_checkpoint({scratch / "none"}, scene);
  EXPECT_FALSE(search.found);
  EXPECT_FALSE(search.foreign);
  EXPECT_TRUE(search.faults.empty());
}

TEST(SceneIdentity, DependsOnTheSourceAndTheEffects) {
  EffectSet all;
  all.set();
  EffectSet fewer = all;
  fewer.reset(index(Effect::push_out));
  EXPECT_EQ(scene_identity("a = 1", all), scene_identity("a = 1", all));
  EXPECT_NE(scene_identity("a = 1", all), scene_identity("a = 2", all));
  EXPECT_NE(scene_identity("a = 1", all), scene_identity("a = 1", fewer));
}

}  // namespace
}  // namespace duet::io::checkpoint_test
