// FNV-1a hash (64 bits) over bytes: the fingerprint of the state in the statistics of every frame.
#pragma once

#include <cstddef>
#include <cstdint>

namespace duet {

/// The hash of no bytes. It is the FNV offset basis without its last digit, so hashes differ from those of
/// other FNV-1a programs.
inline constexpr std::uint64_t hash_seed = 1469598103934665603ULL;

/// Returns the hash of `size` bytes at `data`, appended to those that `hash` stands for. Calls can be
/// chained: the hash of two pieces in a row is that of their concatenation.
inline std::uint64_t hash_bytes(const void* data, std::size_t size, std::uint64_t hash = hash_seed) {
  const auto* bytes = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 1099511628211ULL;
  return hash;
}

}  // namespace duet
