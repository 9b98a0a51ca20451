// Reader of PLY files, ASCII and binary. Assimp 5.2 crashes or hangs on damaged ones, so they are read here.
#pragma once

#include <string>

#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

/// Reads positions, normals, texture coordinates and faces of a PLY file; other properties are skipped.
/// Throws FileError if the file cannot be read or understood, or if a face cannot be cut into a fan of
/// triangles.
TriangleMesh read_ply(const std::string& path);

}  // namespace duet
