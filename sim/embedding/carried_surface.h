// Surfaces of any resolution that the tets of a coarser mesh carry along (hard bindings to tets: Sifakis,
// Shinar, Irving, Fedkiw 2007): for pictures and export, and to be touched.
#pragma once

#include <array>
#include <vector>

#include "sim/geometry/mesh/surface.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

// Every position of the surface has four nodes with barycentric weights in the tet that it lies in; outside
// of all of them, in the one that it lies least outside of, with weights that continue it. Triangles share
// their positions, so that no crack can open.
class CarriedSurface {
 public:
  CarriedSurface() = default;
  // The surface and the mesh at rest in the same coordinates, m.
  CarriedSurface(const Surface& surface, const TetMesh& mesh);

  struct Carrier {
    std::array<int, 4> nodes;
    std::array<double, 4> weights;
  };

  bool empty() const { return carriers_.empty(); }
  const std::vector<Carrier>& carriers() const { return carriers_; }  // of the positions
  // Moves `surface`, which has the topology of the one given, with the mesh's nodes at nodes[0], nodes[1],
  // ...
  void update(const Vec3* nodes, Surface& surface) const;
  // The mean of the values at the nodes around every position, less those that it lies away from; a negative
  // value anywhere is taken over.
  void interpolate(const float* of_nodes, std::vector<float>& values) const;
  // How far outside of its tet any position lies: minus the least barycentric weight, or 0.
  double farthest_outside() const;

 private:
  std::vector<Carrier> carriers_;
};

}  // namespace duet
