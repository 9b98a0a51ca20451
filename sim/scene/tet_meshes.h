// From the shape of a deformable body in a scene to its tetrahedra.
#pragma once

#include <list>

#include "sim/geometry/tet_mesh.h"
#include "sim/scene/scene.h"

namespace duet::scene {

// Makes the meshes of a scene, in the coordinates of their shapes; bodies of one shape share theirs and the
// time to make it.
class TetMeshes {
 public:
  // Throws Error (usage), naming the body, when the spacing is too wide for its surface, or when the scene
  // was read without its meshes.
  const TetMesh& of(const DeformableBody& body);

 private:
  struct Made {
    DeformableBody body;  // the first with this shape
    TetMesh mesh;
  };
  std::list<Made> made_;
};

}  // namespace duet::scene
