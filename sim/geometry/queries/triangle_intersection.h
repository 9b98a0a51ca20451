// Exact tests of triangles against each other, in which rounding can neither hide nor invent an intersection.
#pragma once

#include <span>
#include <vector>

#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// Returns whether two triangles (m) have a point in common, touching included. The test is as exact as
/// orientation(). Only the edges of a triangle without area count.
bool triangles_meet(const std::array<Vec3, 3>& first, const std::array<Vec3, 3>& second);

/// Returns the pairs of triangles that have a point in common but share no vertex, in ascending order.
/// `triangles` hold indices into `positions` (m); the pairs hold indices into `triangles`, the lesser one
/// first.
std::vector<std::array<int, 2>> intersecting_triangles(const std::vector<Vec3>& positions,
                                                       std::span<const Triangle> triangles);

}  // namespace duet
