// What keeps a triangle mesh from being a solid: found, counted and located; repaired where that is safe.
#pragma once

#include <string>
#include <vector>

#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

struct MeshFlaw {
  std::string message;  // "has 3 open edges, the first from [0, 0, 1] to [0, 1, 1]"
  std::string remedy;
};

struct MeshReport {
  std::vector<MeshFlaw> flaws;       // the mesh encloses no volume that could be simulated
  std::vector<std::string> repairs;  // "4 duplicate vertices were joined"
};

// Joins duplicate vertices, drops triangles without area that this leaves, turns a mesh that faces inward as
// a whole, and looks for what cannot be repaired. Positions in messages are the mesh's own coordinates.
MeshReport repair(TriangleMesh& mesh);

}  // namespace duet
