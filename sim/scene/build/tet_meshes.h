// Converts the shape of a deformable body in a scene to tetrahedra.
#pragma once

#include <list>
#include <vector>

#include "sim/geometry/mesh/tet_mesh.h"
#include "sim/scene/scene.h"
#include "sim/scene/world_sizes.h"

namespace duet::scene {

/// Makes the tetrahedral meshes of a scene. Bodies of equal shapes share a mesh, which is made once.
class TetMeshes {
 public:
  /// Returns the mesh of a volume, m, in the coordinates of its shape. The reference stays valid. Throws
  /// Error (usage), naming the body, if the spacing is too wide for its surface, or if the scene was read
  /// without its meshes.
  const TetMesh& of(const DeformableBody& body);
  /// Returns the sizes of the meshes, in the order in which bodies asked for them.
  std::vector<TetSize> sizes() const;

 private:
  struct Made {
    DeformableBody body;  // first body with this shape
    TetMesh mesh;
    int bodies = 0;  // number of bodies that asked for it
  };
  std::list<Made> made_;
};

}  // namespace duet::scene
