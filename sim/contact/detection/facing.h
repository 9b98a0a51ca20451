// Which side of a rigid body a point on the surface of a soft one can touch: one that its surface faces. The
// front of a box that slides over a soft floor is near the floor's particles, too, but only its bottom can
// touch them.
#pragma once

#include "sim/contact/detection/internal_edges.h"

namespace duet {

/// The way out of a host, at `pose`, for a point at `x` (m) of the boundary of a volume, where `nearest` is
/// the one to the host's nearest surface, with the unit normal n outward of the host. The point can touch
/// that surface if it is the support point of the boundary around it in the direction -n: no neighbour is
/// farther in that direction, by more than half the way to it (a dent). A point that is none, and outside the
/// host, touches nothing (depth -infinity) if an edge of the host is nearest, or if no face around the point
/// has a normal m with -n . m >= 0.2: what touches there is the edge. One that is inside leaves the host
/// against the mean normal of the faces around it, if that way is short against them. Points that lie on no
/// face, and those of sheets and rods, keep `nearest`, and so it is with hosts without edges.
WayOut way_out_faced(const Bodies& bodies, int host, const Pose& pose, const SurfacePoint& point,
                     const Vec3& x, const WayOut& nearest);

/// Whether that boundary can touch a plane with the unit normal `normal`, outward of the host, with a point
/// of it at `x` (m): it is the support point, as above, or lies on no face of a volume.
bool is_support_point(const Bodies& bodies, const SurfacePoint& point, const Vec3& x, const Vec3& normal);

/// Of each particle, the boundary's triangles around it, of volumes alone; nothing without volumes.
ElementLists faces_around(const Bodies& bodies);

}  // namespace duet
