// How deep bodies lie in each other, looked at densely. Contact keeps points apart; what overlaps between
// them, FrameStats::max_penetration does not see.
#pragma once

#include <string>

#include "sim/simulation/simulation.h"

namespace duet {

struct DeepestOverlap {
  double depth = 0;           // m
  std::string guest, host;    // the one whose surface lies deepest in the other; empty: none does
  Vec3 place = Vec3::Zero();  // m, in world space
};

struct Overlaps {
  DeepestOverlap rigid, deformable;  // of rigid guests and of deformable ones, in rigid hosts
};

// Of the state now held: looks at places on the surfaces of all bodies, no farther apart than `spacing` (m,
// of at most the sizes of the smallest parts that matter), but for pairs that contact passes over. Smooth
// rigid surfaces are their triangles.
Overlaps find_overlaps(const Simulation& simulation, double spacing);

}  // namespace duet
