// Counts what a world consists of.
#pragma once

#include <vector>

#include "sim/scene/world_sizes.h"

namespace duet {

namespace scene {
struct BuiltWorld;
}

/// Returns the numbers of bodies, particles and elements of a world, the masses, and the step that it would
/// take at `time` (s). `overlaps` are the pairs of bodies that overlap at frame 0.
WorldSizes sizes_of(scene::BuiltWorld& built, const std::vector<InitialOverlap>& overlaps, double time);

}  // namespace duet
