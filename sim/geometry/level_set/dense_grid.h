// Signed distances of a closed mesh at the nodes of a regular grid.
#pragma once

#include <vector>

#include "sim/geometry/mesh/triangle_mesh.h"
#include "sim/geometry/queries/triangle_tree.h"

namespace duet {

struct DenseGrid {
  Vec3 origin = Vec3::Zero();   // m, of the first node
  double spacing = 0;           // m
  Vec3i count = Vec3i::Zero();  // nodes along each axis
  std::vector<float> values;    // m, x fastest

  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(count.y()) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(count.x()) +
           static_cast<std::size_t>(i);
  }
};

// OpenVDB tells inside from outside; the distances are those to the nearest triangle of `tree` (of the same
// mesh), because OpenVDB's own are smoothed next to edges. The grid reaches `margin` cells beyond the mesh.
DenseGrid signed_distances(const TriangleMesh& mesh, const TriangleTree& tree, double spacing, int margin);

}  // namespace duet
