// From the shape of a rigid body in a scene to what the simulator needs of it.
#pragma once

#include <map>
#include <tuple>

#include "sim/geometry/level_set/solid.h"
#include "sim/scene/scene.h"

namespace duet::scene {

// Of any shape but a mesh.
LevelSet level_set(const Shape& shape);

// Makes the solids of a scene; bodies of one mesh at one scale share their level set and the time to make it.
class Solids {
 public:
  explicit Solids(double detail) : detail_(detail) {}  // of drawn surfaces, see shape_surface
  // Throws Error when the scene was read without its meshes.
  const Solid& of(const RigidBody& body);

 private:
  using MeshKey = std::tuple<const TriangleMesh*, double, int, double>;  // mesh, scale, cells, sample spacing
  std::map<MeshKey, Solid> meshes_;
  double detail_;
  Solid other_;
};

}  // namespace duet::scene
