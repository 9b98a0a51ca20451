// Tests whether a place on the surface of a deformable volume is its support point in some direction, so that
// it can touch what comes from there.
#pragma once

#include <vector>

#include "sim/deformable/particles.h"
#include "sim/geometry/mesh/elements_around.h"

namespace duet {

/// Largest sine of the angle by which the surface around a point may rise beyond the point for the point to
/// count as one that can touch (30 degrees).
///
/// The surface rises by more where the point lies in a dent, and all the more where the other body is beside
/// the point instead of opposite to it. A larger value lets points in deeper dents touch.
inline constexpr double max_rise = 0.5;

/// Smallest cosine of the angle between a face's outward normal and a direction for the face to count as
/// facing that direction squarely (18 degrees).
///
/// Such a face needs no closer look. A smaller value would skip look_around() for more points.
inline constexpr double squarely = 0.95;

/// Returns whether all particles of `point` are corners of `face`; the first particle is assumed to be one
/// and not tested.
bool lies_on(const SurfacePoint& point, const Triangle& face);

/// Summary of the boundary faces that a point lies on, seen in some direction.
struct FacesAround {
  Vec3 area = Vec3::Zero();  ///< m^2, sum of the faces' areas along their outward normals
  int count = 0;  ///< number of faces that have an area; 0 where no boundary face contains the point
  /// cosine of the smallest angle between a face normal and the direction; -1 without faces
  double max_facing = -1;
  /// sine of the largest angle by which a face rises beyond the point in the direction; -1 without faces
  double rise = -1;
  Vec3 steepest = Vec3::Zero();  ///< unit outward normal of the face that rises most; zero without faces
};

/// Returns whether one of the faces that `point` lies on faces the unit direction `toward` squarely.
///
/// Most points that touch have such a face and need no closer look. Parameters as in look_around().
bool faces_squarely(const ElementLists& around, const std::vector<Triangle>& triangles,
                    const std::vector<Vec3>& x, const SurfacePoint& point, const Vec3& toward);

/// Summarizes those of `triangles` of which all particles of `point` are corners, in the unit direction
/// `toward`.
///
/// `x` (m) are the positions of all particles, `at` (m) is the position of the point, and `around` lists the
/// triangles of each particle.
FacesAround look_around(const ElementLists& around, const std::vector<Triangle>& triangles,
                        const std::vector<Vec3>& x, const SurfacePoint& point, const Vec3& at,
                        const Vec3& toward);

}  // namespace duet
