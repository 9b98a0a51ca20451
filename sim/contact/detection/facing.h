// Decides which side of a rigid body a point on the surface of a deformable one can touch: a side that its
// surface faces. The front of a box that slides over a soft floor is near the floor's particles, too, but
// only its bottom can touch them.
#pragma once

#include "sim/contact/detection/internal_edges.h"

namespace duet {

/// The surface of a host that is nearest to a point. All is in the host's shape space.
struct NearestSurface {
  Vec3 from;            ///< m: the point.
  double distance = 0;  ///< m: LevelSet::distance() there.
  Vec3 normal;          ///< Unit: LevelSet::normal() there.
};

/// Returns the exit from a host at `pose` for a point at `x` (m, world) of the boundary of a deformable
/// volume. `nearest` is the host's surface nearest to that point; n is its unit normal, outward of the host.
///
/// The point can touch the nearest surface if it is the support point of the boundary around it in the
/// direction -n: no face around it rises beyond it in that direction by more than 30 degrees. More happens
/// where the boundary has a dent, or the surface is beside the point. A point with a face whose outward
/// normal is within 18 degrees of -n counts as one without a closer look. If the point is no support point,
/// the exit leads through the side of the host that a face with the point lies on, if there is one. Otherwise
/// it depends on where the point is:
///
/// - Outside, it touches nothing (depth -infinity) if an edge of the host is nearest, or if no face around
///   the point has an outward normal m with -n . m >= 0.2. The edge touches there instead.
/// - Inside, it leaves the host against the mean normal of the faces around it, if that is possible within a
///   tenth of their size.
///
/// In all other cases the exit is that through `nearest`: for points on no face, points of sheets and rods,
/// hosts without edges, and longer exits.
Exit faced_exit(const Bodies& bodies, int host, const Pose& pose, const SurfacePoint& point, const Vec3& x,
                const NearestSurface& nearest);

/// Returns whether the boundary of a deformable body can touch a plane with its place `point` at `x` (m,
/// world). `normal` (unit, world) is the plane's normal, outward of the host. It can if the place is the
/// support point of the boundary around it in the direction -`normal`, see faced_exit(), or lies on no
/// face of a volume.
bool is_support_point(const Bodies& bodies, const SurfacePoint& point, const Vec3& x, const Vec3& normal);

/// Returns for each particle the faces around it: indices into Bodies::triangles, of volumes alone. The
/// result is empty if there are no volumes.
ElementLists faces_around(const Bodies& bodies);

}  // namespace duet
