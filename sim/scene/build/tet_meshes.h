// From the shape of a deformable body in a scene to its tetrahedra.
#pragma once

#include <list>
#include <vector>

#include "sim/geometry/mesh/tet_mesh.h"
#include "sim/scene/scene.h"
#include "sim/scene/world_sizes.h"

namespace duet::scene {

// Makes the meshes of a scene, in the coordinates of their shapes; bodies of one shape share theirs and the
// time to make it.
class TetMeshes {
 public:
  // Throws Error (usage), naming the body, when the spacing is too wide for its surface, or when the scene
  // was read without its meshes.
  const TetMesh& of(const DeformableBody& body);
  std::vector<TetSize> sizes() const;  // in the order in which bodies asked for them

 private:
  struct Made {
    DeformableBody body;  // the first with this shape
    TetMesh mesh;
    int bodies = 0;  // that asked for it
  };
  std::list<Made> made_;
};

}  // namespace duet::scene
