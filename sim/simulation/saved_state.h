// The state of a simulation as bytes: everything that the next step reads. Checkpoints hold it.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/step/world.h"

namespace duet {

/// Replaces `bytes` by the state of `world` and the number of the frame that it is of.
void pack_state(World& world, std::int64_t frame, std::vector<unsigned char>& bytes);

/// Sets the state of `world` and `frame` from what pack_state() made of the same scene. Throws Error where
/// the number of bytes does not fit; nothing has changed then.
void unpack_state(const std::vector<unsigned char>& bytes, World& world, std::int64_t& frame);

/// Throws Error unless a state that came from outside can be simulated: `loaded` against `built`, a saved
/// state of the same scene. Numbers are finite, orientations are rotations, bodies that never move stand
/// where they were built, and the contacts remembered are of bodies, points and faces that are there.
void check_state(const World& loaded, std::int64_t frame, const std::vector<RigidState>& built);

}  // namespace duet
