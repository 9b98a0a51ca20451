// FNV-1a over bytes: the state's fingerprint in every frame's statistics.
#pragma once

#include <cstddef>
#include <cstdint>

namespace duet {

inline constexpr std::uint64_t hash_seed = 1469598103934665603ULL;

inline std::uint64_t hash_bytes(const void* data, std::size_t size, std::uint64_t hash = hash_seed) {
  const auto* bytes = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 1099511628211ULL;
  return hash;
}

}  // namespace duet
