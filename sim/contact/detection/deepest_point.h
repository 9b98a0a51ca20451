// Points of smooth shapes that come nearest to another body, which no finite set of samples holds: without
// them a wheel would roll as a polygon.
#pragma once

#include "sim/geometry/level_set/level_set.h"

namespace duet {

struct DeepestPoint {
  Vec3 position;  // m, on the surface of the shape
  Vec3 inside;    // m, some way in from it (see contact_plane.h)
};

// How many a shape has: the lowest point of a ball or a torus, one for each end of a capsule, one on each rim
// of a cylinder.
int deepest_point_count(const LevelSet& shape);

// How many numbers `k` there are: two more for capsules and cylinders, the points at a third of the way from
// the middle of the side to either end, which add to how they lie (see line_contact.h).
int deepest_numbers(const LevelSet& shape);

// Number `k` of them towards `host`. All in the host's body space, where the shape's is at `pose`. On a
// torus, on rims and on the side of a cylinder it is the best of a few fixed-point steps, the first of which
// is exact for flat hosts and balls.
DeepestPoint deepest_point(const LevelSet& shape, int k, const Pose& pose, const LevelSet& host);
// The number k of a deepest point, as ContactPoint::guest_point has it: -1 - k, or further down the same
// deepest point against another face of the host.
int deepest_number(const LevelSet& shape, int guest_point);
// Guest point of deepest point k of a shape against the `face`-th of the faces of its host.
int against_face(const LevelSet& shape, int k, int face);
// The guest point of deepest point k against the same face as `guest_point`, if that is against one.
int with_number(const LevelSet& shape, int guest_point, int k);

// The same towards a plane with the unit normal `n`, on the shape's side of which it points, in the shape's
// own space; exact.
DeepestPoint deepest_point(const LevelSet& shape, int k, const Vec3& n);

// Whether a host touches the flat faces of others with its deepest points alone, because it is round: samples
// of these faces would be bumps on which it loses speed.
bool rolls_over_samples(const LevelSet& host);
// Whether samples of a guest tell nothing of how it touches `host`: a ball whose deepest point is all that
// touches, where the guest's distance is exact, or a capsule or torus, where the places on its middle line
// that are nearest to the guest tell it (edge_contacts.h).
bool touches_with_deepest_point(const LevelSet& host, const LevelSet& guest);
// Whether `x` (m, body space) is nearest to the side of a cylinder, which touches like a capsule.
bool is_beside_side(const LevelSet& host, const Vec3& x);

}  // namespace duet
