// Step IV.2 for rigid bodies among each other: overlaps are removed at all contacts at once.
#pragma once

#include <vector>

#include "sim/contact/graph/contact_graph.h"
#include "sim/contact/response/articulated_response.h"

namespace duet {

struct SeparationScratch {
  struct Displacement {
    Vec3 shift = Vec3::Zero();  // m
    Vec3 turn = Vec3::Zero();   // rad
  };
  std::vector<Displacement> body;
  std::vector<double> push;    // kg m, of every contact: a pseudo-impulse along the normal
  std::vector<char> overlaps;  // of every pair
  std::vector<char> measured;  // of every pair: its contacts have the geometry of now
};

// Moves and turns rigid bodies until their contacts overlap by no more than the tolerance. The displacement
// minimizes the kinetic energy it would have as a velocity while no contact closes by more than its gap and
// every overlap opens: the conditions of contact, without friction, in place of the one point a pair of
// equations 1 and 2, which tilts what lies flat. Sweeps over the contacts find it, but slowly where heavy
// bodies rest on light ones: what they leave is taken up level by level by the upper bodies alone, as if the
// lower ones were fixed. Each of `iterations` takes the geometry anew. Positions and orientations change,
// momenta do not. Returns the number of overlapping pairs at the start.
//
// `linked` (or null) moves bodies as their joints let them: what each of them gave way by itself, joints
// would take back, and of wedged links more than that.
int separate_rigid_bodies(Bodies& bodies, const ArticulatedResponse* linked, ContactGraph& graph,
                          int iterations, ContactSet& contacts, SeparationScratch& scratch);

}  // namespace duet
