// Exact tests of triangles against each other: what no rounding can hide or invent.
#pragma once

#include <span>
#include <vector>

#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

// Whether they have a point in common, touching included; as exact as `orientation`. Of a triangle without
// area only the edges count.
bool triangles_meet(const std::array<Vec3, 3>& first, const std::array<Vec3, 3>& second);

// The pairs of triangles that have a point in common but share no vertex, in ascending order, as indices into
// `triangles` (vertices are indices into `positions`).
std::vector<std::array<int, 2>> intersecting_triangles(const std::vector<Vec3>& positions,
                                                       std::span<const Triangle> triangles);

}  // namespace duet
