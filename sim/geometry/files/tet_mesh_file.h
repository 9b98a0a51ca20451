// Tetrahedral meshes from files and as files.
#pragma once

#include <string>
#include <string_view>

#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// Reads the tets of a Medit file (.mesh) or a Gmsh file (.msh, version 2 or 4.1), both as text, in the units
/// and axes of the file. Everything else in the file is skipped. Throws FileError if the file cannot be
/// understood or has no tet. The mesh need not be valid; see repair().
TetMesh read_tet_mesh(const std::string& path);

/// Every medit_text() begins with this; files of Medit and Gmsh lay the same words out in other lines.
inline constexpr std::string_view medit_start = "MeshVersionFormatted 2\nDimension 3\nVertices\n";
/// Every vtk_text() begins with this, which includes its title.
inline constexpr std::string_view vtk_start = "# vtk DataFile Version 3.0\nTetrahedra\nASCII\n";

/// Returns the text of a Medit file (.mesh), which read_tet_mesh(), Gmsh and other programs read. Coordinates
/// are kept to the last bit.
std::string medit_text(const TetMesh& mesh);

/// Returns the text of a legacy VTK file (.vtk), for ParaView.
std::string vtk_text(const TetMesh& mesh);

}  // namespace duet
