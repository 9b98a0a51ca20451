// Thin deformable bodies between two bodies that no force moves, as between a press and its bed: where these
// leave less room than the body is thick, contact has no solution.
#pragma once

#include "sim/contact/detection/contact_point.h"

namespace duet {

/// Makes room where there is none. Of two hosts without finite mass that are h - 2 p apart at a place of a
/// deformable guest of the thickness h (m), at the end of a step of `dt` (s) with their velocities now, and
/// that face each other there, each contact's gap grows by p and a little play: the guest is as much thinner,
/// its middle surface lies halfway between the two, and the conditions of contact have a solution again. What
/// the two hold is pressed without bound, so that friction, if there is any, holds it. Where there is room, p
/// is zero. Around the rims of two hosts on either side of a sheet, where their normals lead along it and
/// both overlap it, its contacts' gaps grow to zero: contact would draw it out sideways.
///
/// Sets ContactPoint::yielded; `pinches` (or null) receives the guests and their two hosts with the least
/// room.
void yield_where_pinched(const Bodies& bodies, double dt, ContactSet& contacts, std::vector<Pinch>* pinches);

}  // namespace duet
