// Body-centred cubic (BCC) lattices of tetrahedra over a level set, after Labelle and Shewchuk, Isosurface
// Stuffing (2007): nodes are the corners and centres of cubic cells, uniform or the leaves of an octree.
#pragma once

#include <vector>

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

struct BccLattice {
  Vec3 origin = Vec3::Zero();  // m
  double spacing = 0;          // m, edge of the finest cells
  std::vector<Vec3i> nodes;    // in half spacings from the origin
  std::vector<Tet> tets;

  Vec3 position(int node) const {
    return origin + spacing / 2 * nodes[static_cast<std::size_t>(node)].cast<double>();
  }
  // Whether the edge joins two corners or two centres of neighbouring finest cells; the shorter ones join a
  // corner to a centre.
  bool is_long(int a, int b) const;
};

// Covers the inside of `shape` with finest cells wherever its surface may pass; every tet that the surface
// may cut is of the uniform lattice. If `graded`, cells grow with the depth below the surface, and neighbours
// differ in size by a factor of two at most.
BccLattice bcc_lattice(const LevelSet& shape, double spacing, bool graded);

}  // namespace duet
