// Checks whether a triangle mesh bounds a solid. Flaws are counted and located, and repaired where that is
// safe.
#pragma once

#include <string>
#include <vector>

#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

/// One kind of flaw that cannot be repaired.
struct MeshFlaw {
  std::string message;  ///< "has 3 open edges, the first from [0, 0, 1] to [0, 1, 1]".
  std::string remedy;   ///< Advice for the user.
};

/// The findings and actions of repair().
struct MeshReport {
  /// The flaws that are left. If there are any, the mesh encloses no volume that could be simulated.
  std::vector<MeshFlaw> flaws;
  /// The repairs, such as "4 duplicate vertices were joined".
  std::vector<std::string> repairs;
};

/// Repairs a triangle mesh where that is safe, and reports its other flaws. It joins duplicate vertices
/// (those within 1e-6 of the diagonal of the mesh), drops the triangles without area that this leaves and
/// unused vertices, and turns a mesh that faces inward as a whole. Flaws are coordinates that are not finite,
/// open or non-manifold edges, inconsistent orientation, several parts, and no volume. Positions in messages
/// are coordinates of the mesh.
MeshReport repair(TriangleMesh& mesh);

}  // namespace duet
