// Signed distances from a closed mesh at the nodes of a regular grid.
#pragma once

#include <vector>

#include "sim/base/assert.h"
#include "sim/geometry/mesh/triangle_mesh.h"
#include "sim/geometry/queries/triangle_tree.h"

namespace duet {

/// Values at the nodes of a regular grid.
struct DenseGrid {
  Vec3 origin = Vec3::Zero();   ///< Position of the first node, m.
  double spacing = 0;           ///< Distance between neighboring nodes, m.
  Vec3i count = Vec3i::Zero();  ///< Number of nodes along each axis.
  std::vector<float> values;    ///< Signed distances, m; x runs fastest, then y.

  /// Returns the index into `values` of the node with the numbers i, j, k along the axes.
  std::size_t index(int i, int j, int k) const {
    DUET_ASSERT(i >= 0 && i < count.x() && j >= 0 && j < count.y() && k >= 0 && k < count.z());
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(count.y()) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(count.x()) +
           static_cast<std::size_t>(i);
  }
};

/// Returns the signed distances from a closed mesh on a grid with nodes `spacing` (m) apart that reaches
/// `margin` cells beyond the mesh. `tree` holds the triangles of the same mesh. OpenVDB only tells inside
/// from outside; the magnitudes are distances to the nearest triangle of `tree`, because OpenVDB's own are
/// smoothed next to edges.
DenseGrid signed_distances(const TriangleMesh& mesh, const TriangleTree& tree, double spacing, int margin);

}  // namespace duet
