#include "sim/base/file_hash.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace duet {
namespace {

static_assert(std::endian::native == std::endian::little, "XXH64 reads little-endian words");

// The primes of the XXH64 specification.
constexpr std::uint64_t prime_1 = 0x9E3779B185EBCA87, prime_2 = 0xC2B2AE3D27D4EB4F,
                        prime_3 = 0x165667B19E3779F9, prime_4 = 0x85EBCA77C2B2AE63,
                        prime_5 = 0x27D4EB2F165667C5;
// Bytes of a block: one 8-byte word for each of the four accumulators.
constexpr std::size_t block = 32;

// Returns the word at an address that need not be aligned.
template <class Word>
Word word_at(const unsigned char* bytes) {
  Word word;
  std::memcpy(&word, bytes, sizeof word);
  return word;
}

// Mixes a word into an accumulator.
std::uint64_t round(std::uint64_t chain, std::uint64_t word) {
  return std::rotl(chain + word * prime_2, 31) * prime_1;
}

// Mixes a block of 32 bytes into the accumulators.
void take_block(std::array<std::uint64_t, 4>& chains, const unsigned char* bytes) {
  for (std::size_t i = 0; i < 4; ++i) chains[i] = round(chains[i], word_at<std::uint64_t>(bytes + 8 * i));
}

}  // namespace

FileHash::FileHash() : chains_{prime_1 + prime_2, prime_2, 0, 0 - prime_1} {}

void FileHash::add(std::string_view text) {
  const auto* bytes = reinterpret_cast<const unsigned char*>(text.data());
  std::size_t left = text.size();
  const std::size_t filled = size_ % block;
  size_ += left;
  if (filled > 0) {
    const std::size_t more = std::min(left, block - filled);
    std::memcpy(waiting_.data() + filled, bytes, more);
    bytes += more;
    left -= more;
    if (filled + more < block) return;
    take_block(chains_, waiting_.data());
  }
  std::array<std::uint64_t, 4> chains = chains_;  // a local copy stays in registers, a member would not
  for (; left >= block; bytes += block, left -= block) take_block(chains, bytes);
  chains_ = chains;
  if (left > 0) std::memcpy(waiting_.data(), bytes, left);
}

std::uint64_t FileHash::value() const {
  std::uint64_t hash = prime_5;
  if (size_ >= block) {
    hash = std::rotl(chains_[0], 1) + std::rotl(chains_[1], 7) + std::rotl(chains_[2], 12) +
           std::rotl(chains_[3], 18);
    for (const std::uint64_t chain : chains_) hash = (hash ^ round(0, chain)) * prime_1 + prime_4;
  }
  hash += size_;
  const unsigned char* bytes = waiting_.data();
  std::size_t left = size_ % block;
  for (; left >= 8; bytes += 8, left -= 8)
    hash = std::rotl(hash ^ round(0, word_at<std::uint64_t>(bytes)), 27) * prime_1 + prime_4;
  if (left >= 4) {
    hash = std::rotl(hash ^ word_at<std::uint32_t>(bytes) * prime_1, 23) * prime_2 + prime_3;
    bytes += 4;
    left -= 4;
  }
  for (; left > 0; ++bytes, --left) hash = std::rotl(hash ^ *bytes * prime_5, 11) * prime_1;
  hash = (hash ^ (hash >> 33)) * prime_2;
  hash = (hash ^ (hash >> 29)) * prime_3;
  return hash ^ (hash >> 32);
}

}  // namespace duet
