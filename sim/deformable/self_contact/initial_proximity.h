// Which parts of a body belong near each other because they were so at time 0, and which only lay there, as
// the turns of a coil of rope.
#pragma once

#include "sim/deformable/self_contact/collision_candidates.h"

namespace duet {

/// How near each other the elements of a pair were at time 0, with the distance h that pairs keep.
enum class InitialProximity : char {
  apart,     ///< Of two bodies, or farther apart than 1.5 h: they keep the distance h.
  lying,     ///< Nearer, but far from each other along the body: they keep the lesser of h and that distance.
  belonging  ///< Nearer, and near each other along the body: nothing keeps them apart.
};

/// Returns the initial proximity of the elements of a pair (Bridson et al. 2002, section 6.1, keep nothing
/// apart that was nearer than h, and so let the turns of a coil through each other).
///
/// Elements are far from each other along the body if no way along its edges that is shorter than 3 h at time
/// 0 connects them. If more than 64 particles are nearer than that, they count as near.
InitialProximity initial_proximity(const CandidatePair& pair, bool is_one_body,
                                   const CollisionSurface& surface);

/// Returns the distance of the elements of a pair at time 0, m.
double initial_distance(const CandidatePair& pair, const CollisionSurface& surface);

}  // namespace duet
