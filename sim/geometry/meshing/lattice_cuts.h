// Where a surface cuts the edges of a BCC lattice, and the nodes that are moved onto it: steps 2 to 4 of
// Labelle and Shewchuk, Isosurface Stuffing (2007).
#pragma once

#include <vector>

#include "sim/geometry/meshing/bcc_lattice.h"

namespace duet {

enum class Side : signed char { inside = -1, surface = 0, outside = 1 };

struct Cut {
  int inside = 0, outside = 0;  // nodes of the edge
  double place = 0;             // on the way from the inner node to the outer one, in [0, 1]
};

// Cuts nearer than this part of their edge move its end (alpha_long and alpha_short in section 3 of the
// paper). The values balance the least against the largest dihedral angle over all that the stencils can
// meet.
constexpr double least_cut_place(bool is_long) { return is_long ? 0.26 : 0.40; }

// A lattice whose nodes know their side of the surface. Cuts next to a node are gone: the node has moved onto
// the nearest of them. All others keep the least distance from both ends that bounds the dihedral angles.
struct CutLattice {
  BccLattice lattice;
  std::vector<Vec3> positions;  // m, of the nodes
  std::vector<Side> sides;      // of the nodes
  std::vector<Cut> cuts;        // of edges between inside and outside, sorted by `inside`, then by `outside`
  std::size_t cut_of(int inside, int outside) const;  // index into `cuts` of an edge that is there
};

// Takes the tets with a node inside of `shape`. A node moves only where the inside keeps a manifold boundary.
CutLattice cut_lattice(BccLattice lattice, const LevelSet& shape);

}  // namespace duet
