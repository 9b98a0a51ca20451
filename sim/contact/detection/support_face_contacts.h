// Where balls, capsules, tori and the rims of cylinders touch the boundary of a deformable body between the
// points of its faces: without that a marble would sink in between them.
#pragma once

#include <vector>

#include "sim/contact/detection/body_bounds.h"
#include "sim/contact/detection/edge_contacts.h"

namespace duet {

// Whether a host of shape `host` can touch the faces of `guest` there.
bool deepest_points_count(const DeformableBody& guest, const LevelSet& host);

// Whether between two points of a flat face or a straight edge, `apart` (m), a host may be so deep that it
// counts: one with edges always, a round one if it bends enough.
bool is_coarse_for(const LevelSet& host, double apart);

// Appends, for each face of `guest`, the place on it that a deepest point of `host` towards it is above, if
// that is less than `margin` (m) outside of it, or no deeper inside than half the way between the points of
// the face; on either side of a sheet. `node` is numbered as corners are. `host_bounds` are those of the
// host.
void find_places_at_deepest_points(const Bodies& bodies, const DeformableBody& guest,
                                   const BodyBounds& host_bounds, int host, double margin,
                                   std::vector<EdgeContact>& found);

}  // namespace duet
