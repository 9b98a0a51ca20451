// Measures how deep bodies overlap, with dense samples of their surfaces. FrameStats::max_penetration looks
// at contact points only and misses overlaps between them.
#pragma once

#include <string>

#include "sim/simulation/simulation.h"

namespace duet {

/// The deepest overlap of one kind of pairs.
struct DeepestOverlap {
  double depth = 0;           ///< Depth, m; 0: no overlap.
  std::string guest,          ///< Name of the body whose surface lies inside the other; empty: no overlap.
      host;                   ///< Name of the rigid body that it lies in; empty: no overlap.
  Vec3 place = Vec3::Zero();  ///< Deepest point of the guest's surface, m, world space.
};

/// The deepest overlaps with rigid hosts: those of rigid guests and those of deformable guests.
struct Overlaps {
  DeepestOverlap rigid,  ///< Deepest overlap of a rigid body in another one.
      deformable;        ///< Deepest overlap of a deformable body in a rigid one.
};

/// Finds the deepest overlaps in the current state of `simulation`. Triangles and segments of all surfaces
/// are subdivided until they are no longer than `spacing` (m), which should be at most the size of the
/// smallest parts that matter. Pairs that contact excludes are skipped. Smooth rigid surfaces are represented
/// by their render triangles.
Overlaps find_overlaps(const Simulation& simulation, double spacing);

}  // namespace duet
