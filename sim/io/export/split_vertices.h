// Surfaces in which one index names position, normal and texture coordinate of a vertex, as glTF and
// graphics cards have them.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/geometry/mesh/surface.h"

namespace duet::io {

/// Vertices and triangles of a surface, with one index for each vertex.
struct SplitVertices {
  /// Indices of the position, texture coordinate and normal of each vertex, in the order of positions. A
  /// position has several vertices if its triangles differ there in normal or texture coordinate.
  std::vector<Corner> vertices;
  std::vector<std::uint32_t> indices;  ///< indices into `vertices`, three for each triangle

  /// Returns true if there are `positions` vertices and vertex i has position i, for all i.
  bool keeps_positions(std::size_t positions) const;
};

/// Choice whether positions that no triangle uses have a vertex.
enum class UnusedPositions {
  left_out,  ///< they have none
  kept       ///< they have one, without texture coordinate and normal (indices -1)
};

/// Splits the positions of a surface into vertices. Corners with equal indices share a vertex.
SplitVertices split_vertices(const Surface& surface, UnusedPositions unused = UnusedPositions::left_out);

}  // namespace duet::io
