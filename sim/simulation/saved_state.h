// Converts the state of a simulation, which is all that the next step reads, to and from bytes. Checkpoints
// hold these bytes.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/step/world.h"

namespace duet {

/// Replaces `bytes` by the state of `world` and by `frame`, the number of the frame that this state belongs
/// to. `world` is not changed; it is not const because one visitor serves reading and writing.
void pack_state(World& world, std::int64_t frame, std::vector<unsigned char>& bytes);

/// Restores `world` and `frame` from the bytes that pack_state() made of the same scene. Throws Error (files)
/// and changes nothing if the number of bytes does not fit. Values are not checked: see check_state().
void unpack_state(const std::vector<unsigned char>& bytes, World& world, std::int64_t& frame);

/// Throws Error (files) unless a state that came from outside can be simulated. `loaded` is the world with
/// this state, `built` are the rigid states of the same scene before it was loaded. Checks that numbers are
/// finite, that orientations are rotations, that bodies that never move stand where they were built, and that
/// the cached contacts name existing bodies, points and faces and are sorted.
void check_state(const World& loaded, std::int64_t frame, const std::vector<RigidState>& built);

}  // namespace duet
