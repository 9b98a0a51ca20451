// What deformable bodies touch themselves and each other with: particles, edges and triangles.
#pragma once

#include <span>
#include <vector>

#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

struct CollisionBody {
  bool itself = false;   // whether it collides with itself, not only with others
  double thickness = 0;  // m; the gap that two surfaces keep is the mean of theirs
  double friction = 0;   // Coulomb coefficient; a pair uses the smaller one
};

// All elements in the order of the bodies; particles by their global indices.
struct CollisionSurface {
  std::vector<CollisionBody> bodies;
  std::vector<std::array<int, 1>> points;
  std::vector<std::array<int, 2>> edges;
  std::vector<Triangle> triangles;
  std::vector<int> point_body, edge_body, triangle_body;  // indices into `bodies`
  std::vector<Vec3> initial;                              // m, positions of all particles at time 0

  // Adds a body: its triangles, their edges and `segments` of curves, and the particles of all of these.
  void add(const CollisionBody& body, std::span<const Triangle> surface,
           std::span<const std::array<int, 2>> segments);
};

// The length of the shortest edge of the triangles and segments, m; 0 without any.
double shortest_edge(const std::vector<Vec3>& x, std::span<const Triangle> surface,
                     std::span<const std::array<int, 2>> segments);

}  // namespace duet
