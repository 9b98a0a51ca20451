// Triangle meshes from files.
#pragma once

#include <string>

#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

/// Reads an OBJ, PLY, STL or glTF file (.obj .ply .stl .gltf .glb). All its objects become one mesh, with
/// polygons cut into triangles, in the units and axes of the file. Normals and texture coordinates are kept
/// only if every corner has valid ones; those of STL files are dropped. Throws FileError if the file cannot
/// be read or its ending is unknown. The mesh need not be closed or valid; see repair().
TriangleMesh read_mesh(const std::string& path);

}  // namespace duet
