// Triangles of rigid shapes for pictures and export.
#pragma once

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/mesh/surface.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

/// Returns the render surface of a shape with a formula, in body space. Boxes have flat faces, round shapes
/// have rows and columns with smooth normals, and cylinders have sharp rims. `detail` in (0, 1] scales the
/// number of rows and columns; at 1 a ball has 64 columns.
Surface shape_surface(const LevelSet& shape, double detail = 1);

/// Returns the render surface of a mesh, with its normals and texture coordinates. If it has no normals, they
/// are split where triangles meet at more than 40 degrees. If it has no texture coordinates, planar_uv()
/// gives them.
Surface mesh_surface(const TriangleMesh& mesh);

}  // namespace duet
