// Forces of contact on the surfaces that are drawn and exported, from the impulses on particles.
#pragma once

#include <vector>

#include "sim/scene/build/build_world.h"
#include "sim/simulation/frame.h"

namespace duet {

/// Sets `out` to the impulses of ContactTally::of_frame() over `seconds` (s), the time of the frame; to zero
/// if it is 0 or if there was no step. The scene has `rigid_count` rigid bodies without the ground, and
/// `surfaces` are the drawn surfaces at the frame.
///
/// The vertices of a volume are particles, which keep their force. Skins and thin bodies have other vertices:
/// there each particle gives its force to the vertices that it moves, in proportion to their weights and to
/// the area that they turn against the force, or to the nearest vertex if it moves none. The sum over a body
/// is that of its particles in all cases.
void write_contact_loads(const scene::BuiltWorld& built, std::size_t rigid_count,
                         const std::vector<BodySurface>& surfaces, double seconds, ContactLoads& out);

}  // namespace duet
