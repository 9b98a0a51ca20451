// The particles, edges and triangles with which deformable bodies touch themselves and each other.
#pragma once

#include <span>
#include <vector>

#include "sim/geometry/mesh/elements_around.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// Constants of self-contact of one body.
struct CollisionBody {
  bool itself = false;   ///< whether it collides with itself, not only with others
  double thickness = 0;  ///< m; the gap that two surfaces keep is the mean of theirs
  double friction = 0;   ///< Coulomb coefficient; a pair uses the smaller one
};

/// The surfaces of all bodies, in the order of the bodies; particles have their global indices.
struct CollisionSurface {
  std::vector<CollisionBody> bodies;       ///< constants of the bodies
  std::vector<std::array<int, 1>> points;  ///< particles of all elements, ascending within a body
  std::vector<std::array<int, 2>> edges;   ///< edges of the triangles, and segments of curves
  std::vector<Triangle> triangles;         ///< boundaries of volumes, and shells
  std::vector<int> point_body,             ///< by point: index into `bodies`
      edge_body,                           ///< by edge: index into `bodies`
      triangle_body;                       ///< by triangle: index into `bodies`
  std::vector<Vec3> initial;               ///< m, positions of all particles at time 0
  ElementLists edges_around;               ///< by particle: numbers of its edges

  /// Adds a body: its triangles, their edges and the `segments` of curves, and the particles of all of these.
  void add(const CollisionBody& body, std::span<const Triangle> surface,
           std::span<const std::array<int, 2>> segments);
  /// Sets `initial` and `edges_around`, after all bodies have been added. `x` (m) are the positions of all
  /// particles at time 0.
  void finish(const std::vector<Vec3>& x);
};

/// Returns the length of the shortest edge of the triangles and segments at the positions `x`, m; 0 without
/// any.
double shortest_edge(const std::vector<Vec3>& x, std::span<const Triangle> surface,
                     std::span<const std::array<int, 2>> segments);

}  // namespace duet
