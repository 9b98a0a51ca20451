// Measures how deep bodies overlap, for the statistics of every frame.
#pragma once

#include "sim/contact/detection/contact_point.h"

namespace duet {

/// Returns the depth of the deepest overlap of any contact point with any body at the present positions, m,
/// not negative. `filter` says which kinds of pairs count. Pairs that never touch, and points that no force
/// moves against a host that none moves, are left out.
double max_penetration(const Bodies& bodies, const CandidateFilter& filter);

}  // namespace duet
