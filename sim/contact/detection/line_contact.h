// Where a cylinder or capsule lies on a flat face with the whole of its side.
#pragma once

#include "sim/contact/detection/candidate_search.h"
#include "sim/state/bodies.h"

namespace duet {

// Its two ends carry it as well as all of the line does, but friction at the ends alone would brake its spin
// twice as strongly as that of an even line |x| <= a, whose points have these mean distances from the middle:
//   mean of |x| = a/2 = 1/4 a + 3/4 a/3,  mean of x^2 = a^2/3 = 1/4 a^2 + 3/4 (a/3)^2.
// Where both ends of the pair's rigid guest are near one plane of its host and hardly one higher than the
// other, appends the points at a third of the way from the middle to them to the touches from `begin` on, and
// makes all four a patch of chunk.reduction with shares of 1/8 for the ends and 3/8 for the others.
// `is_reversed` says which touches are those of this guest (NearPoint::reversed).
void add_lines(const Bodies& bodies, const BodyPair& pair, bool is_reversed, std::size_t begin,
               CandidateSearch::Chunk& chunk);

}  // namespace duet
