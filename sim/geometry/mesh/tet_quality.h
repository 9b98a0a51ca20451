// How good the tets of a mesh are for simulation.
#pragma once

#include <array>

#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

struct TetQuality {
  std::size_t nodes = 0, tets = 0;
  double volume = 0;                     // m^3
  double least_angle = 0;                // degrees, between two faces of a tet
  double largest_angle = 0;              // degrees
  double smallest_altitude = 0;          // m, from a node to the face opposite to it: bounds the time step
  double shortest_edge = 0;              // m
  double longest_edge = 0;               // m
  std::array<std::size_t, 18> angles{};  // dihedral angles in [0, 10), [10, 20), ... degrees, six a tet
};

std::array<double, 6> dihedral_angles(const TetMesh& mesh, const Tet& tet);  // degrees, in [0, 180]
bool has_dihedral_angles_within(const TetMesh& mesh, const Tet& tet, double least,
                                double largest);                // degrees
double smallest_altitude(const TetMesh& mesh, const Tet& tet);  // m

TetQuality tet_quality(const TetMesh& mesh);

}  // namespace duet
