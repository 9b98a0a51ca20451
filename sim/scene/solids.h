// Converts the shape of a rigid body in a scene to the data that the simulator needs of it.
#pragma once

#include <map>
#include <tuple>

#include "sim/geometry/level_set/solid.h"
#include "sim/scene/scene.h"

namespace duet::scene {

/// Returns the analytic level set of a shape of any kind but a mesh, in the shape's own coordinates (m).
LevelSet level_set(const Shape& shape);

/// Makes the solids of a scene's rigid bodies. Bodies of one mesh with equal parameters share their level
/// set, which is then made once.
class Solids {
 public:
  /// `detail`, in (0, 1], scales the resolution of the drawn surfaces of round shapes; see shape_surface().
  explicit Solids(double detail) : detail_(detail) {}
  /// Returns the solid of `body`. The reference stays valid for a mesh; for other shapes it is valid until
  /// the next call. Throws Error (usage) if the body has a mesh and the scene was read without meshes.
  const Solid& of(const RigidBody& body);

 private:
  using MeshKey = std::tuple<const TriangleMesh*, double, int, double>;  // mesh, scale, cells, sample spacing
  std::map<MeshKey, Solid> meshes_;
  double detail_;
  Solid other_;  // solid of the last body that is no mesh
};

}  // namespace duet::scene
