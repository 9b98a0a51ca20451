// Triangles of rigid shapes for pictures and export.
#pragma once

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/mesh/surface.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

// The render surface of a shape with a formula, in body space: flat faces for the box, rows and columns with
// smooth normals for round shapes, sharp rims for the cylinder. `detail` in (0, 1] scales the number of rows
// and columns; at 1 a ball has 64 columns.
Surface shape_surface(const LevelSet& shape, double detail = 1);

// That of a mesh, with its normals and texture coordinates. Without them, normals are split where triangles
// meet at more than 40 degrees, and texture coordinates are the metres across the dominant axis of each face.
Surface mesh_surface(const TriangleMesh& mesh);

}  // namespace duet
