// The version of the numerics: which programs compute the same bits.
#pragma once

#include <cstdint>

namespace duet {

/// Programs with this number in common give the same bits for a scene, whatever compiler, instructions,
/// processor and number of threads they have. Raise it by one in every commit that changes an expected state
/// hash of tests/hashes/, so that `--resume` never joins two motions into one run unnoticed.
inline constexpr std::uint32_t numerics_version = 16;

}  // namespace duet
