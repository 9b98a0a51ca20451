// Support points: the points of smooth shapes that come nearest to another body. No finite set of samples
// holds them, and without them a wheel would roll as a polygon.
#pragma once

#include "sim/geometry/level_set/level_set.h"

namespace duet {

/// A support point of a shape.
struct ShapeSupportPoint {
  Vec3 position;  ///< m: the point, on the surface of the shape.
  Vec3 inside;    ///< m: a point of the shape some way in from `position`, see contact_plane().
};

/// Returns how many support points a shape has: one for a ball or a torus, one for each end of a capsule, one
/// for each rim of a cylinder, and none for other shapes.
int support_point_count(const LevelSet& shape);

/// Returns how many numbers `k` of support points a shape has. Capsules and cylinders have two more than
/// support_point_count(): the points of the side at a third of the way from its middle to either end, which
/// are used where such a body lies on a face (line_contact.h).
int support_numbers(const LevelSet& shape);

/// Returns support point `k` of `shape` towards `host`. The result and `pose`, that of the shape, are in the
/// shape space of `host`. For tori, rims and the side of cylinders it is the best of a few fixed-point steps,
/// the first of which is exact for flat hosts and balls.
ShapeSupportPoint support_point(const LevelSet& shape, int k, const Pose& pose, const LevelSet& host);

/// Returns support point `k` of `shape` towards a plane with the unit normal `n`, which points to the shape's
/// side of the plane. All is in the shape's own shape space. The result is exact.
ShapeSupportPoint support_point(const LevelSet& shape, int k, const Vec3& n);

/// Returns whether a host touches the flat faces of others with its support points alone, because it is
/// round. Samples of these faces would be bumps on which it loses speed.
bool rolls_over_samples(const LevelSet& host);
/// Returns whether samples of a guest tell nothing about how it touches `host`. So it is for capsules and
/// tori, which touch at the places on their center line that are nearest to the guest (edge_contacts.h), and
/// for balls if the distance from the guest is exact: their support point is all that touches.
bool ignores_samples(const LevelSet& host, const LevelSet& guest);
/// Returns whether the support points of the guest are left to the ball that it meets: the pair in which the
/// ball is the guest has the exact nearest point, since the distance of the ball's center from a round shape
/// is exact. A second point beside it would give the ball a spin.
bool is_left_to_ball(const LevelSet& host, const LevelSet& guest);
/// Returns whether the surface of a cylinder nearest to `x` (m, shape space) is its side, which touches as a
/// capsule does. Returns false for all other shapes.
bool is_beside_side(const LevelSet& host, const Vec3& x);

}  // namespace duet
