// PLY files, ASCII and binary. Assimp 5.2 crashes or hangs on damaged ones, so that these are read here.
#pragma once

#include <string>

#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

// Reads positions, normals, texture coordinates and faces; other properties are skipped. Throws FileError.
TriangleMesh read_ply(const std::string& path);

}  // namespace duet
