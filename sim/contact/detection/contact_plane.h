// Chooses the plane of a rigid body's surface that a point of another body rests against.
#pragma once

#include "sim/geometry/level_set/level_set.h"

namespace duet {

/// A plane of a shape's surface, as seen from a point of another body. All vectors are in shape
/// space.
struct ContactPlane {
  Vec3 normal;     ///< Unit, outward of the shape.
  double gap = 0;  ///< m: signed distance of the point from the plane.
  Vec3 foot;       ///< m: point of the surface that has the normal.
  /// True if the other body lies on the outer side of the plane. If not, the point touches nothing: it is
  /// beside an edge over which its body reaches, or level with that edge, so that its body slides over it.
  bool faces = true;
  /// Index of the body whose surface goes on from `foot`, if it hides the host's surface there, see
  /// exposed_plane(); -1: the foot is not hidden.
  int continued_by = -1;
};

/// Returns whether a body faces a surface with the unit normal `normal`: whether the angle between the normal
/// and `way` (m), the displacement from a point on the body's surface into the body, is below 73 degrees. At
/// the corner of a box it is 55 degrees.
bool faces(const Vec3& normal, const Vec3& way);

/// Returns whether the plane with the unit normal `normal` ends at `foot`, a point of the surface of `shape`,
/// seen in the direction `way` in which the other body lies from there (all in the shape space of `shape`,
/// m). That body slides over the end, as over the side of a rail that it lies on, up to a depth of 2e-4 of
/// the length of `way`. For meshes the surface is that of the triangles.
bool ends_at(const LevelSet& shape, const Vec3& foot, const Vec3& normal, const Vec3& way);

/// Finds the plane of `shape` that a point at `x` rests against, where `inside` is a point of the same body
/// some way in from `x` (both in m, in the shape space of `shape`).
///
/// The nearest surface tells little about a point near an edge: a corner that stands 1 mm inside the rim of a
/// table and 0.01 mm deep is nearest to the table's side, and would be pushed off. So the plane is that of
/// the surface nearest to `inside`, from where the side on which the body lies is plain. A consequence is
/// that a point leaves a shape thinner than the distance from `x` to `inside` by the face through which it
/// entered. If `x` is not opposite the surface so found, because it is beside an edge, the surface nearest to
/// `x` counts, and so it does for a sphere, if `x` is not beyond its center.
ContactPlane contact_plane(const LevelSet& shape, const Vec3& x, const Vec3& inside);

/// Finds the plane that contact_plane() finds, from LevelSet::exact(). For meshes the foot then lies on the
/// surface also if it is far from `inside`, at some ten times the cost.
ContactPlane exact_contact_plane(const LevelSet& shape, const Vec3& x, const Vec3& inside);

}  // namespace duet
