// Support-face contacts: where balls, capsules, tori and the rims of cylinders touch the boundary of a
// deformable body between the points of its faces. Without them a marble would sink in between these points.
#pragma once

#include <vector>

#include "sim/contact/detection/body_bounds.h"
#include "sim/contact/detection/edge_contacts.h"

namespace duet {

/// Returns whether the support points of a host can touch the faces of `guest` between their surface points.
bool has_support_face_contacts(const DeformableBody& guest, const LevelSet& host);

/// Returns whether a host may be so deep between two points of a flat face or a straight edge, `apart` (m)
/// from each other, that a contact between them is needed. For hosts with edges it always is; for those swept
/// by a ball it is if `apart` is more than a fifth of the ball's radius.
bool is_coarse_for(const LevelSet& host, double apart);

/// Appends the support-face contacts of `host` with `guest`: for each face of `guest`, and each support point
/// of `host` towards it, the place on the face that the support point is above.
///
/// The support point has to be less than `margin` (m) outside of the face, or no deeper inside than
/// max_below(). Sheets are looked at from both sides. FeatureId::index continues the numbers of the host's
/// corners and convex vertices. `host_bounds` are the bounds of `host`.
void find_support_face_contacts(const Bodies& bodies, const DeformableBody& guest,
                                const BodyBounds& host_bounds, int host, double margin,
                                std::vector<EdgeContact>& found);

}  // namespace duet
