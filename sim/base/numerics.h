// The version of the numerics, which tells whether two programs compute the same bits.
#pragma once

#include <cstdint>

namespace duet {

/// Number of the current numerics. Programs that share it give the same bits for a scene, whatever their
/// compiler, instructions, processor and number of threads. Raise it by one in every commit that changes an
/// expected state hash of tests/hashes/, so that `--resume` never joins two different motions into one run
/// unnoticed.
inline constexpr std::uint32_t numerics_version = 37;

}  // namespace duet
