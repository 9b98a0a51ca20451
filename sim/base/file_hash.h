/// XXH64 (Y. Collet, github.com/Cyan4973/xxHash, seed 0): the hash of files, as `xxhsum -H1` prints it. It
/// takes 32 bytes at a time in four independent chains, ten times as fast as hash_bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace duet {

/// The hash of bytes that come in pieces of any sizes.
class FileHash {
 public:
  FileHash();
  void add(std::string_view bytes);
  std::uint64_t value() const;                  ///< of all bytes so far; more may follow
  std::uint64_t size() const { return size_; }  ///< number of bytes so far

 private:
  std::array<std::uint64_t, 4> chains_;
  std::array<unsigned char, 32> waiting_{};  ///< the last size_ % 32 bytes
  std::uint64_t size_ = 0;
};

}  // namespace duet
