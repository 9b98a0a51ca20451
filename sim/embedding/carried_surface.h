// Surfaces of any resolution that the tetrahedra of a coarser mesh carry along (hard bindings to tetrahedra:
// Sifakis, Shinar, Irving, Fedkiw 2007). They are drawn, exported, and touched by other bodies.
#pragma once

#include <array>
#include <vector>

#include "sim/geometry/mesh/surface.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// A surface whose positions are embedded in tetrahedra.
///
/// Every position has four nodes with barycentric weights: those of the tetrahedron that contains it. Outside
/// of all tetrahedra it is one of the nearest, with weights that extrapolate. Triangles share their
/// positions, so no crack can open.
class CarriedSurface {
 public:
  /// Makes a surface without positions.
  CarriedSurface() = default;
  /// Embeds the positions of `surface` in the tetrahedra of `mesh`, both at rest in the same coordinates (m).
  ///
  /// A position outside takes, of the tetrahedra whose bounding boxes are within a first search distance that
  /// meets any, the one in which its smallest weight is largest. The mesh must have a tetrahedron.
  CarriedSurface(const Surface& surface, const TetMesh& mesh);

  /// The embedding of one position.
  struct Carrier {
    std::array<int, 4> nodes;       ///< nodes of the mesh
    std::array<double, 4> weights;  ///< barycentric weights; they add up to 1 and are negative outside
  };

  /// Returns whether the surface has no positions.
  bool empty() const { return carriers_.empty(); }
  /// Returns the embedding of each position.
  const std::vector<Carrier>& carriers() const { return carriers_; }
  /// Returns position number `i` (m) as the mesh's nodes carry it, which `nodes` points to (m).
  Vec3 position(std::size_t i, const Vec3* nodes) const;
  /// Moves the positions of `surface` with the mesh's nodes, which `nodes` points to (m), and updates its
  /// normals.
  ///
  /// `surface` must have the topology of the one that was embedded.
  void update(const Vec3* nodes, Surface& surface) const;
  /// Interpolates values of the nodes to the positions, as means over the four nodes without those of
  /// negative weight.
  ///
  /// If a node of the tetrahedron has a negative value, the position gets the smallest one: negative values
  /// mark, for example, inverted elements.
  void interpolate(const float* of_nodes, std::vector<float>& values) const;
  /// Returns how far outside of its tetrahedron any position lies: minus the smallest barycentric weight, or
  /// 0.
  double farthest_outside() const;

 private:
  std::vector<Carrier> carriers_;
};

}  // namespace duet
