// Tetrahedral meshes without symmetry, and the masses of their nodes.
#pragma once

#include <random>
#include <vector>

#include "tests/support/meshes.h"

#include "sim/geometry/mesh/tet_mesh.h"

namespace duet::test {

// Returns a lattice of `cells` unit cells whose nodes are moved by up to `amount` (m) along every axis. All
// tetrahedra keep a positive volume up to 0.1 m.
inline TetMesh shaken_lattice(const Vec3i& cells, double amount, unsigned seed) {
  TetMesh mesh = box_lattice(cells.cast<double>(), cells);
  std::mt19937 random(seed);
  for (Vec3& x : mesh.nodes) x += amount * random_vector(random);
  return mesh;
}

// Returns the lumped masses of the nodes (kg) for a density in kg/m^3: every tetrahedron gives a quarter of
// its mass to each of its nodes.
inline std::vector<double> corner_masses(const TetMesh& mesh, double density) {
  std::vector<double> mass(mesh.nodes.size(), 0);
  const auto node = [&](int i) { return mesh.nodes[static_cast<std::size_t>(i)]; };
  for (const Tet& t : mesh.tets)
    for (int i : t)
      mass[static_cast<std::size_t>(i)] +=
          density / 4 * tet_volume(node(t[0]), node(t[1]), node(t[2]), node(t[3]));
  return mass;
}

// Returns `count` vectors in [-1, 1]^3.
inline std::vector<Vec3> random_vectors(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Vec3> vectors(count);
  for (Vec3& v : vectors) v = random_vector(random);
  return vectors;
}

}  // namespace duet::test
