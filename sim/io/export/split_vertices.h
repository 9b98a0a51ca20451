/// Surfaces with one index a vertex, as glTF and graphics cards have them.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/geometry/mesh/surface.h"

namespace duet::io {

struct SplitVertices {
  /// The position, texture coordinates and normal of each vertex, in order of position: a position whose
  /// triangles differ in normal or texture coordinates there has several vertices.
  std::vector<Corner> vertices;
  std::vector<std::uint32_t> indices;  ///< into vertices, three a triangle

  /// Returns true if vertex i has position i for all positions of a surface with `positions` of them.
  bool keeps_positions(std::size_t positions) const;
};

/// Whether positions that no triangle uses have a vertex, without texture coordinates and normal (-1).
enum class UnusedPositions { left_out, kept };

SplitVertices split_vertices(const Surface& surface, UnusedPositions unused = UnusedPositions::left_out);

}  // namespace duet::io
