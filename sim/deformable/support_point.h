// Whether a place on the surface of a soft body is its support point in some direction, so that it can touch
// what comes from there.
#pragma once

#include <vector>

#include "sim/deformable/particles.h"
#include "sim/geometry/mesh/elements_around.h"

namespace duet {

/// Sine of the angle by which the surface around a point may rise beyond it, at most, for the point to be one
/// that can touch: it rises so in a dent, and all the more where what it would touch is beside it.
inline constexpr double most_rise = 0.5;

/// Cosine of the angle of a face's outward normal to a direction up to which it faces there squarely (18
/// degrees).
inline constexpr double squarely = 0.95;

/// Whether all particles of `point` are corners of `face`, that of the first being known to be.
bool lies_on(const SurfacePoint& point, const Triangle& face);

/// The faces of a boundary that a point lies on.
struct FacesAround {
  Vec3 area = Vec3::Zero();  ///< m^2, sum of their areas along their outward normals
  int count = 0;
  double most_facing = -1;       ///< cosine of the least angle of their normals to the direction
  double rise = -1;              ///< sine of the greatest angle by which they rise beyond the point in it
  Vec3 steepest = Vec3::Zero();  ///< unit, the outward normal of the face that does
};

/// Whether one of those faces faces `toward` squarely: most points that touch have one that does, and need no
/// closer look.
bool faces_squarely(const ElementLists& around, const std::vector<Triangle>& triangles,
                    const std::vector<Vec3>& x, const SurfacePoint& point, const Vec3& toward);

/// Looks at those of `triangles` that all particles of `point` are corners of, with the particles at `x` (m)
/// and the point at `at` (m), in the unit direction `toward`; `around` lists the triangles of each particle.
FacesAround look_around(const ElementLists& around, const std::vector<Triangle>& triangles,
                        const std::vector<Vec3>& x, const SurfacePoint& point, const Vec3& at,
                        const Vec3& toward);

}  // namespace duet
