// Measures of how well the tets of a mesh are suited for simulation.
#pragma once

#include <array>

#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// Quality of a tetrahedral mesh. All values are 0 if it has no tet.
struct TetQuality {
  std::size_t nodes = 0,  ///< Number of nodes.
      tets = 0;           ///< Number of tets.
  double volume = 0;      ///< Total volume, m^3.
  double min_angle = 0;   ///< Smallest dihedral angle, degrees.
  double max_angle = 0;   ///< Largest dihedral angle, degrees.
  double min_altitude =
      0;  ///< Smallest distance from a node to the opposite face, m; it bounds the time step.
  double shortest_edge = 0;  ///< Length of the shortest edge, m.
  double longest_edge = 0;   ///< Length of the longest edge, m.
  /// Histogram of the dihedral angles, six per tet: [0, 10), [10, 20), ..., [170, 180] degrees.
  std::array<std::size_t, 18> angles{};
};

/// Returns the six dihedral angles of a tet in degrees, in [0, 180].
std::array<double, 6> dihedral_angles(const TetMesh& mesh, const Tet& tet);
/// Returns whether all dihedral angles of `tet` lie in [least, largest], in degrees. It compares cosines and
/// so is faster than dihedral_angles().
bool has_dihedral_angles_within(const TetMesh& mesh, const Tet& tet, double least,
                                double largest);  // degrees
/// Returns the smallest distance (m) from a node of `tet` to the opposite face; negative for a tet of
/// negative volume.
double min_altitude(const TetMesh& mesh, const Tet& tet);

/// Measures all tets of a mesh.
TetQuality tet_quality(const TetMesh& mesh);

}  // namespace duet
