// Finds the plane in which two rigid bodies meet that are apart when a step begins.
#pragma once

#include "sim/contact/detection/contact_point.h"

namespace duet {

/// Returns the tolerance (m) for level surfaces of two rigid bodies: surfaces whose heights differ by less
/// are level. It is 1e-4 of the size of the smaller body.
double level_depth(const Bodies& bodies, int a, int b);

/// Returns level_depth() of the bodies of a contact, m.
double level_depth(const Bodies& bodies, const ContactPoint& contact);

/// Gives contact points of rigid pairs the plane in which the bodies meet within the step.
///
/// Contact points are found with the bodies where they are at the beginning of a step. For a point that comes
/// from beside its host, such as the corner of a box that slides over the gap between two tiles, the nearest
/// place of the host is then an edge or a wall, while the body passes over the edge or meets the host at
/// another face. Each contact point that is apart, and that the motion of the step brings into reach, gets
/// the plane
///
///   n = normal of the host where the point first is deeper in the host than level_depth(), or at the end of
///       the step if it never is.
///
/// Its gap is set such that gap + dt n . v_rel is the distance from that plane at the end of the step, and
/// ContactPoint::meets_ahead is set. An edge contact gets the plane in ContactPoint::edge instead. The path
/// of dynamic bodies is the one with `velocity`: that of the beginning of the step, without what forces add
/// in it. With forces, a resting body would have fallen by g dt^2 / 2 and would run into walls that it is
/// level with. Other bodies move with the velocities of `bodies`. A sample that the host would hit along the
/// guest's own surface meets nothing: its gap becomes infinite. Support points against one of
/// several faces of a mesh keep their plane; ContactPoint::stays is set for all other contacts of rigid
/// pairs.
///
/// `dt` is the step (s). `fall` (m) bounds how far forces may move bodies from the path: contacts that stay
/// farther apart keep their plane.
void find_impact_planes(const Bodies& bodies, const VelocityState& velocity, double dt,
                        OrientationUpdate orientation, double fall, ContactSet& contacts);

/// Returns the touch at the end of a step of `dt` (s) for a contact point with ContactPoint::meets_ahead. The
/// bodies move with their velocities now, and `change` (m/s) is added to that of the guest relative to the
/// host.
Touch touch_ahead(const Bodies& bodies, const ContactPoint& contact, double dt, const Vec3& change);

}  // namespace duet
