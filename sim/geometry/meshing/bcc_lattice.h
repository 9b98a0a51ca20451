// Body-centered cubic (BCC) lattices of tetrahedra over a level set, after Labelle and Shewchuk 2007,
// "Isosurface Stuffing". Nodes are the corners and centers of cubic cells, which are uniform or the leaves of
// an octree.
#pragma once

#include <vector>

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// The sizes of the cells of a lattice.
enum class CellSizes {
  uniform,  ///< All cells have the size of those at the surface.
  graded    ///< Cells double in size with their depth below the surface, which keeps its resolution.
};

/// A BCC lattice of tetrahedra.
struct BccLattice {
  Vec3 origin = Vec3::Zero();  ///< Position of the node (0, 0, 0), m.
  double spacing = 0;          ///< Edge of the finest cells, m.
  std::vector<Vec3i> nodes;    ///< Coordinates in half spacings from `origin`.
  std::vector<Tet> tets;       ///< The tetrahedra, as indices into `nodes`.

  /// Returns the position of a node, m.
  Vec3 position(int node) const {
    return origin + spacing / 2 * nodes[static_cast<std::size_t>(node)].cast<double>();
  }
  /// Returns whether the edge between two nodes joins two corners or two centers of neighboring finest cells.
  /// The shorter edges join a corner to a center.
  bool is_long(int a, int b) const;
};

/// Returns a lattice that covers the inside of `shape`, with finest cells of `spacing` (m) wherever its
/// surface may pass, so that every tet that the surface may cut belongs to the uniform lattice. The sizes
/// of neighbors differ by a factor of two at most.
BccLattice bcc_lattice(const LevelSet& shape, double spacing, CellSizes sizes);

}  // namespace duet
