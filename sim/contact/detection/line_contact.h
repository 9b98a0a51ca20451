// Line contacts: a cylinder or capsule lies on a flat face with the whole of its side.
#pragma once

#include "sim/contact/detection/candidate_search.h"
#include "sim/contact/detection/pair_direction.h"
#include "sim/state/bodies.h"

namespace duet {

/// Appends the inner points of line contacts to the touches of `pair` in `chunk`.
///
/// If both ends of the pair's rigid guest, a cylinder or capsule, are near one plane of its host and almost
/// equally high above it, the two points at a third of the distance from the middle to the ends are appended.
/// All four become a patch of `chunk.reduction` with shares of 1/8 for the ends and 3/8 for the inner points.
/// The ends alone carry the same load, but friction at them would brake the spin twice as strongly as that of
/// an even line |x| <= a. With these shares the points have its mean distances from the middle:
///
///   mean of |x| = a/2 = 1/4 a + 3/4 a/3,  mean of x^2 = a^2/3 = 1/4 a^2 + 3/4 (a/3)^2.
///
/// The search looks at the touches from `begin` on whose NearPoint::reversed says `direction`: those with
/// this guest.
void add_lines(const Bodies& bodies, const BodyPair& pair, PairDirection direction, std::size_t begin,
               CandidateSearch::Chunk& chunk);

}  // namespace duet
