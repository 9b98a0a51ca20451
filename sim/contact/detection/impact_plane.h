// In which plane two rigid bodies meet that are apart when a step begins.
#pragma once

#include "sim/contact/detection/contact_point.h"

namespace duet {

// m, of the contact of a rigid pair: surfaces that differ by less in height are level.
double level_depth(const Bodies& bodies, const ContactPoint& contact);

// Contact points are found with the bodies where they are at the beginning of a step. For a point that comes
// from beside its host, such as the corner of a box that slides over the gap between two tiles, the nearest
// place of the host is then an edge or a wall, while the body passes over the edge or meets the host at
// another face. Each contact point of a rigid pair that is apart and that the motion of the step brings into
// reach is given the plane
//
//   n = normal of the host where the point first is deeper in the host than the tolerance for level surfaces,
//       or at the end of the step if it never is,
//
// with its gap now, such that gap + dt n . v_rel is the distance to that plane at the end; `meets_ahead` is
// set. The path is the one with `velocity`: that of the beginning of the step, without what forces add in it.
// With them what rests would have fallen by g dt^2 / 2 and would run into walls that it is level with. Bodies
// that are not dynamic move with the velocities of `bodies`. A sample that the host would hit along the
// guest's own surface meets nothing: its gap is infinite. `dt`: s; `fall`: m, how far forces may move bodies
// from that path: what stays farther off is left as it is.
void find_impact_planes(const Bodies& bodies, const VelocityState& velocity, double dt,
                        OrientationUpdate orientation, double fall, ContactSet& contacts);

// The touch at the end of a step of `dt` (s), with the bodies' velocities now changed by `change` (m/s, of
// the guest relative to the host), of a contact point that meets ahead.
Touch touch_ahead(const Bodies& bodies, const ContactPoint& contact, double dt, const Vec3& change);

}  // namespace duet
