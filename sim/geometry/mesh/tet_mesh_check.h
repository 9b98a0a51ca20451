// Checks whether a tetrahedral mesh from a file can be a body.
#pragma once

#include "sim/geometry/mesh/mesh_check.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// Repairs a tetrahedral mesh where that is safe, and reports its other flaws. It drops nodes that no tet
/// uses and turns tets of negative volume. Flaws are tets without volume, faces that more than two tets
/// share, and several parts. Positions in messages are coordinates of the mesh.
MeshReport repair(TetMesh& mesh);

/// Returns the number of parts that no common face connects; 0 if there is no tet.
int connected_parts(const TetMesh& mesh);

}  // namespace duet
