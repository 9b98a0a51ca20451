// Measures how deep bodies overlap, with dense samples of their surfaces. FrameStats::max_penetration looks
// at contact points only and misses overlaps between them.
#pragma once

#include <optional>

#include "sim/simulation/simulation.h"

namespace duet {

/// The deepest overlaps with rigid hosts: those of rigid guests and those of deformable guests.
struct Overlaps {
  DeepestOverlap rigid,  ///< Deepest overlap of a rigid body in another one.
      deformable;        ///< Deepest overlap of a deformable body, as contact sees it, in a rigid one.
  /// Deepest overlap of a drawn surface that is not the contact surface in a rigid body; empty if there is
  /// none.
  std::optional<DeepestOverlap> drawn;
};

/// Finds the deepest overlaps in the current state of `simulation`. Triangles and segments of all surfaces
/// are subdivided until they are no longer than `spacing` (m), which should be at most the size of the
/// smallest parts that matter. Pairs that contact excludes are skipped. Smooth rigid surfaces are represented
/// by their render triangles.
Overlaps find_overlaps(const Simulation& simulation, double spacing);

}  // namespace duet
