#include "sim/base/file_hash.h"

#include <random>
#include <string>
#include <utility>

#include <gtest/gtest.h>

namespace duet::file_hash_test {
namespace {

std::uint64_t hash_of(std::string_view text) {
  FileHash hash;
  hash.add(text);
  return hash.value();
}

// The expected values are what the reference implementation prints for these texts (`xxhsum -H1`).
TEST(FileHash, IsXxh64) {
  for (const auto& [text, expected] : {std::pair<std::string_view, std::uint64_t>{"", 0xef46db3751d8e999},
                                       {"a", 0xd24ec4f1a98c6e5b},
                                       {"abc", 0x44bc2cf5ad770999},
                                       {"xxhash", 0x32dd38952c4bc720},
                                       {"Nobody inspects the spammish repetition", 0xfbcea83c8a378bf1}})
    EXPECT_EQ(hash_of(text), expected) << text;
}

// A hash depends on the bytes alone and not on the pieces in which they arrive. The sizes from 0 to 200 and
// pieces of up to 39 bytes cross the block size of 32 bytes in all ways.
TEST(FileHash, DoesNotDependOnThePieces) {
  std::mt19937 random(1);
  std::string text(1000, '\0');
  for (char& c : text) c = static_cast<char>(random());
  for (std::size_t size = 0; size <= 200; ++size) {
    const std::string_view whole = std::string_view(text).substr(0, size);
    FileHash pieces;
    for (std::string_view rest = whole; !rest.empty();) {
      const std::size_t n = std::min<std::size_t>(rest.size(), random() % 40);
      pieces.add(rest.substr(0, n));
      rest.remove_prefix(n);
    }
    EXPECT_EQ(pieces.value(), hash_of(whole)) << size;
    EXPECT_EQ(pieces.size(), size);
  }
}

// The hash changes with every single bit of 100 bytes: a damaged file does not go unnoticed because a byte is
// skipped.
TEST(FileHash, TellsEveryFlippedBit) {
  std::string text(100, 'x');
  const std::uint64_t whole = hash_of(text);
  for (std::size_t bit = 0; bit < 8 * text.size(); ++bit) {
    text[bit / 8] ^= static_cast<char>(1 << bit % 8);
    EXPECT_NE(hash_of(text), whole) << bit;
    text[bit / 8] ^= static_cast<char>(1 << bit % 8);
  }
}

}  // namespace
}  // namespace duet::file_hash_test
