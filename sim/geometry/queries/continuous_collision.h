// Continuous collision tests of a point against a triangle and of two edges whose corners move on straight
// lines, by conservative advancement.
//
// Between two convex elements there is at any time a plane that separates them by their distance. Along its
// normal n the corners move at constant speeds, so the time up to which that very plane keeps them apart by
// `gap` follows from four or three divisions; there, the next plane is taken from the closest points. No root
// of a polynomial is sought, so there is none to be missed: whether motion is coplanar, edges are parallel,
// triangles degenerate or nothing moves at all, a wrong plane only makes the test stop early.
#pragma once

#include <optional>

#include "sim/geometry/queries/closest_points.h"

namespace duet {

enum class ElementPair { point_triangle, edge_edge };

ClosestPoints closest_points(ElementPair kind, const FourPoints& x);

struct Impact {
  double time = 0;  // 0..1
  ClosestPoints at;
  Vec3 normal = Vec3::Zero();  // unit, from the second element to the first at that time
};

// The corners move from `start` to `end`. If there is no result, the elements stay at least `gap` (m, > 0)
// apart at all times in [0, 1], rounding included. Otherwise they did so up to its time, when they are nearer
// than 1.25 gap; or, after as many planes as are tried, may be farther. Elements nearer than that at the
// start meet at time 0, and where they touch exactly the normal is zero.
std::optional<Impact> first_impact(ElementPair kind, const FourPoints& start, const FourPoints& end,
                                   double gap);

}  // namespace duet
