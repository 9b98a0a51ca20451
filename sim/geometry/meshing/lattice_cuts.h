// The points where a surface cuts the edges of a BCC lattice, and the nodes that are moved onto it: steps 2
// to 4 of Labelle and Shewchuk 2007, "Isosurface Stuffing".
#pragma once

#include <vector>

#include "sim/geometry/meshing/bcc_lattice.h"

namespace duet {

/// The side of the surface on which a node lies.
enum class Side : signed char {
  inside = -1,  ///< The level set is negative.
  surface = 0,  ///< The node was moved onto the surface.
  outside = 1   ///< The level set is zero or positive.
};

/// A point where the surface cuts an edge of the lattice.
struct Cut {
  int inside = 0,    ///< The node of the edge that lies inside.
      outside = 0;   ///< The node of the edge that lies outside.
  double place = 0;  ///< Fraction of the edge, from the inner node (0) to the outer one (1).
};

/// Returns the fraction of an edge within which a cut moves the end of that edge: alpha_long or alpha_short
/// in section 3 of Labelle and Shewchuk 2007. The values balance the least against the largest dihedral angle
/// over all cases that the stencils can meet. Larger values move more nodes.
constexpr double min_cut_place(bool is_long) { return is_long ? 0.26 : 0.40; }

/// A lattice whose nodes know their side of the surface. No cut lies next to a node: the node has moved onto
/// the nearest of its close cuts. All other cuts keep the least distance from both ends of their edge that
/// bounds the dihedral angles.
struct CutLattice {
  /// The lattice; its own node positions are those before nodes were moved.
  BccLattice lattice;
  std::vector<Vec3> positions;  ///< Positions of the nodes, m.
  std::vector<Side> sides;      ///< Sides of the nodes.
  /// Cuts of the edges between inside and outside, sorted by `inside`, then by `outside`.
  std::vector<Cut> cuts;
  /// Returns the index into `cuts` of the cut of an edge, which must have one.
  std::size_t cut_of(int inside, int outside) const;
};

/// Cuts a lattice by the surface of `shape`. It keeps the tets that have a node inside. A node moves onto the
/// surface only if the boundary of the inside stays a manifold.
CutLattice cut_lattice(BccLattice lattice, const LevelSet& shape);

}  // namespace duet
