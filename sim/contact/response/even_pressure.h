// How the load of a flat contact spreads over its points.
#pragma once

#include "sim/contact/detection/contact_point.h"

namespace duet {

// The normal impulses of a flat face's points are not determined by the motion: any that give the same force
// and moments move the bodies alike, but friction holds where the load is. Of all these the ones that
// minimize
//   sum of p_i^2 / share_i,  p_i >= 0,
// are p_i = share_i times a linear function of the place: pressure that is even where the load is in the
// middle, and grows towards the side to which it moves. Sets the normal impulses of the pair's patches to
// them, as far as its points touch: those that hold an impulse or close at no less than their target, to
// within `tolerance` (m/s). Bodies and their velocities stay as they are. Faces that stick keep their
// impulses: how these spread does not matter, and what has come to rest is not stirred up.
void spread_evenly(const Bodies& bodies, double tolerance, const ContactPair& pair, ContactSet& contacts);

}  // namespace duet
