// Tetrahedral meshes from files and as files.
#pragma once

#include <string>

#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// Reads the tets of a Medit file (.mesh) or a Gmsh file (.msh, version 2 or 4.1), both as text, in the units
/// and axes of the file. Everything else in the file is skipped. Throws FileError if the file cannot be
/// understood or has no tet. The mesh need not be valid; see repair().
TetMesh read_tet_mesh(const std::string& path);

/// Returns the text of a Medit file (.mesh), which read_tet_mesh(), Gmsh and other programs read. Coordinates
/// are kept to the last bit.
std::string medit_text(const TetMesh& mesh);

/// Returns the text of a legacy VTK file (.vtk), for ParaView.
std::string vtk_text(const TetMesh& mesh);

}  // namespace duet
