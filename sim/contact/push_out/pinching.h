// Thin deformable bodies that are pinched between two static or kinematic bodies, as between a press and its
// bed. If these leave less room than the body is thick, contact has no solution.
#pragma once

#include "sim/contact/detection/contact_point.h"

namespace duet {

/// Makes pinched deformable guests thinner, so that the conditions of contact have a solution again. If two
/// static or kinematic hosts face each other and will be h - 2 p apart at a place of a guest of thickness h
/// (m), after `dt` (s) with their present velocities, the gaps of the contacts there grow by p and a little
/// play. The guest is then thinner by 2 p, and its middle surface lies halfway between the hosts. p is zero
/// if there is room. The hosts press without bound, so that friction, if there is any, holds the guest
/// (is_pinched_fast()).
///
/// A face or an edge yields as a whole: the contacts of its corners yield by as much as the largest of its
/// own.
///
/// Around the rims of two hosts on either side of a sheet, where their normals lead along the sheet and both
/// overlap it, the gaps grow to zero and the play, because contact would draw the sheet out sideways.
///
/// Sets ContactPoint::yielded and is_pinched, and changes ContactPoint::gap by the change of it. Pinched face
/// samples lose their friction. Adds each guest with its two hosts and the least room to `pinches`, unless
/// that is null.
void yield_where_pinched(const Bodies& bodies, double dt, ContactSet& contacts, std::vector<Pinch>* pinches);

}  // namespace duet
