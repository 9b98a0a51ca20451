// Continuous collision tests of a point against a triangle and of two edges, whose corners move on straight
// lines, by conservative advancement.
//
// At any time, a plane separates two convex elements by their distance. Along its normal n the corners move
// at constant speeds, so the time up to which that plane keeps the elements apart by `gap` follows from three
// or four divisions. At that time the next plane is taken from the closest points. No root of a polynomial is
// sought, so none can be missed. Coplanar motion, parallel edges, degenerate triangles and elements at rest
// are no special cases: a wrong plane only makes the test stop early.
#pragma once

#include <optional>

#include "sim/geometry/queries/closest_points.h"

namespace duet {

/// The kinds of pairs of elements.
enum class ElementPair {
  point_triangle,  ///< A point, then the three corners of a triangle.
  edge_edge        ///< The two ends of one edge, then those of another.
};

/// Returns the closest points of a pair of elements.
ClosestPoints closest_points(ElementPair kind, const FourPoints& x);

/// The first time at which two moving elements are close to each other.
struct Impact {
  double time = 0;             ///< Fraction of the motion, in [0, 1].
  ClosestPoints at;            ///< The closest points at that time.
  Vec3 normal = Vec3::Zero();  ///< Unit vector from the second element to the first at that time; zero if
                               ///< they touch exactly.
};

/// Returns the first time at which two elements come close to each other while their corners move from
/// `start` to `end` (m). Without a result, the elements stay at least `gap` (m, > 0) apart at all times in
/// [0, 1], rounding included. With a result, they did so up to its time and are then nearer than 1.25 `gap`,
/// or may still be farther apart if the bound on the number of planes was reached. Elements that are nearer
/// than that at the start meet at time 0.
std::optional<Impact> first_impact(ElementPair kind, const FourPoints& start, const FourPoints& end,
                                   double gap);

}  // namespace duet
