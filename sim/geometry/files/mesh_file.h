// Triangle meshes from files.
#pragma once

#include <string>

#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

// Reads an OBJ, PLY, STL or glTF file (.obj .ply .stl .gltf .glb): all its objects as one mesh, polygons cut
// into triangles, in the file's own units and axes. Throws FileError. See repair() for what the mesh may
// lack.
TriangleMesh read_mesh(const std::string& path);

}  // namespace duet
