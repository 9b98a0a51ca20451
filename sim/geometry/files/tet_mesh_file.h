// Tetrahedral meshes from files and as files.
#pragma once

#include <string>

#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

// Reads the tets of a Medit file (.mesh) or a Gmsh file (.msh, version 2 or 4.1), both as text, in the file's
// own units and axes; all else in it is skipped. Throws FileError. See repair() for what the mesh may lack.
TetMesh read_tet_mesh(const std::string& path);

// The text of a Medit file (.mesh), which read_tet_mesh, Gmsh and others read: every coordinate is kept to
// the last bit.
std::string medit_text(const TetMesh& mesh);

// That of a legacy VTK file (.vtk), for ParaView.
std::string vtk_text(const TetMesh& mesh);

}  // namespace duet
