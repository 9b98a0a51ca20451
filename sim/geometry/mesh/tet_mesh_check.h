// What keeps a tetrahedral mesh from a file from being a body.
#pragma once

#include "sim/geometry/mesh/mesh_check.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

// Turns tets that are the wrong way round, drops nodes that no tet uses, and looks for what cannot be
// repaired. Positions in messages are the mesh's own coordinates.
MeshReport repair(TetMesh& mesh);

// Parts that no common face connects; 0 without any tet.
int connected_parts(const TetMesh& mesh);

}  // namespace duet
