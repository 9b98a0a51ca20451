// Parts of deformable bodies that are held where they overlap a rigid body, as a flag that is pinned at the
// surface of its pole and overlaps it by half its thickness.
#pragma once

#include "sim/contact/detection/contact_point.h"

namespace duet {

/// Lets contact take what pins prescribe: at a place of a guest with weights w_k for its particles k, the gap
/// to a host that forces do not move grows by
///
///   sum of w_k max(0, -g_k)   over the particles that are held,
///
/// with the gaps g_k (m) of those particles to the plane of the contact. Without that, the particles that are
/// free would have to open what the held ones overlap, by levers that grow without bound towards the pin.
///
/// Has to be called after yield_where_pinched(). Sets ContactPoint::yielded to the larger of the two, and
/// changes ContactPoint::gap by the change of it.
void yield_where_held(const Bodies& bodies, ContactSet& contacts);

}  // namespace duet
