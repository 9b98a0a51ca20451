// Tests that tetrahedra kept in files come back to the last bit, or not at all.
#include "sim/scene/build/tet_cache.h"

#include <chrono>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"

namespace duet::scene::tet_cache_test {
namespace {

class TetCacheFiles : public testing::Test {
 protected:
  ScratchFolder scratch;
  TriangleMesh surface{
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}, {}, {}};
  TetMesh mesh{{{0.1, 1e-300, -0.0}, {1, 0, 0}, {0, 1.0 / 3, 0}, {0, 0, 1e300}}, {{0, 1, 2, 3}}};

  void SetUp() override { set_tet_cache({scratch / "cache", "build 1"}); }
  void TearDown() override { set_tet_cache({}); }
  TetKey key(double scale = 1, std::optional<double> spacing = {}, bool graded = false) const {
    return tet_key(surface, scale, spacing, graded);
  }
  std::filesystem::path only_file() const {
    const auto files = io::files_in(scratch / "cache");
    EXPECT_EQ(files.size(), 1U);
    return files.at(0);
  }
};

TEST_F(TetCacheFiles, GiveBackTheSameBits) {
  EXPECT_FALSE(cached_tets(key()));
  keep_tets(key(), mesh);
  const std::optional<TetMesh> read = cached_tets(key());
  ASSERT_TRUE(read);
  EXPECT_EQ(std::memcmp(read->nodes.data(), mesh.nodes.data(), 4 * sizeof(Vec3)), 0);
  EXPECT_EQ(read->tets, mesh.tets);
}

TEST_F(TetCacheFiles, AreOfOneMeshOneFillingAndOneBuild) {
  keep_tets(key(), mesh);
  EXPECT_FALSE(cached_tets(key(2)));
  EXPECT_FALSE(cached_tets(key(1, 0.1)));
  EXPECT_FALSE(cached_tets(key(1, {}, true)));
  set_tet_cache({scratch / "cache", "build 2"});
  EXPECT_FALSE(cached_tets(key()));
  set_tet_cache({scratch / "cache", "build 1"});
  EXPECT_TRUE(cached_tets(key()));
  surface.positions[1].x() = std::nextafter(1.0, 2.0);
  EXPECT_FALSE(cached_tets(key()));
}

TEST_F(TetCacheFiles, WithAnyDamageAreLeftOutAndRemoved) {
  keep_tets(key(), mesh);
  const std::filesystem::path file = only_file();
  const std::string whole = io::read_file(file);
  for (std::size_t i = 0; i < whole.size(); ++i) {
    std::string damaged = whole;
    damaged[i] ^= 16;
    io::write_atomically(file, damaged);
    EXPECT_FALSE(cached_tets(key())) << "byte " << i;
    EXPECT_FALSE(std::filesystem::exists(file)) << "byte " << i;
  }
  for (const std::size_t length : {std::size_t{0}, std::size_t{20}, whole.size() - 1}) {
    io::write_atomically(file, whole.substr(0, length));
    EXPECT_FALSE(cached_tets(key())) << length << " bytes";
  }
  io::write_atomically(file, whole);
  EXPECT_TRUE(cached_tets(key()));
}

TEST_F(TetCacheFiles, LeaveTheOldestWhereRoomIsScarce) {
  set_tet_cache({scratch / "cache", "build 1", 450});  // bytes: room for two files of about 170 bytes each
  for (const double scale : {1.0, 2.0}) keep_tets(key(scale), mesh);
  // Files that are written within one tick of the clock have equal times, so the test sets their times back.
  const auto now = std::filesystem::file_time_type::clock::now();
  for (const auto& file : io::files_in(scratch / "cache"))
    std::filesystem::last_write_time(file, now - std::chrono::hours(1));
  EXPECT_TRUE(cached_tets(key(1))) << "which is a use";
  keep_tets(key(3), mesh);
  EXPECT_TRUE(cached_tets(key(1)));
  EXPECT_FALSE(cached_tets(key(2)));
  EXPECT_TRUE(cached_tets(key(3)));
  EXPECT_EQ(tet_cache_size(scratch / "cache").files, 2);
}

TEST_F(TetCacheFiles, AreRemovedAlone) {
  keep_tets(key(), mesh);
  io::write_atomically(scratch / "cache/other.txt", "kept");
  EXPECT_EQ(clear_tet_cache(scratch / "cache").files, 1);
  EXPECT_EQ(only_file().filename(), "other.txt");
  EXPECT_EQ(clear_tet_cache(scratch / "nowhere").files, 0);
}

TEST_F(TetCacheFiles, AFolderThatCannotBeWrittenIsAsGoodAsNone) {
  set_tet_cache({"/proc/nowhere/cache", "build 1"});
  keep_tets(key(), mesh);
  EXPECT_FALSE(cached_tets(key()));
  set_tet_cache({});
  keep_tets(key(), mesh);
  EXPECT_FALSE(cached_tets(key()));
}

}  // namespace
}  // namespace duet::scene::tet_cache_test
