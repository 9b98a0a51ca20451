// Tetrahedral meshes of the inside of level sets, by isosurface stuffing: Labelle and Shewchuk 2007,
// "Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral Angles" (SIGGRAPH).
#pragma once

#include <optional>

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/mesh/tet_mesh.h"
#include "sim/geometry/mesh/triangle_mesh.h"
#include "sim/geometry/meshing/bcc_lattice.h"

namespace duet {

/// Lower bound of the dihedral angles of every mesh, whatever the level set, in degrees. It is that of the
/// worst cut that the stencils can meet.
inline constexpr double min_dihedral_angle = 9.5;
/// Upper bound of the dihedral angles of every mesh, whatever the level set, in degrees. It is that of the
/// worst cut that the stencils can meet.
inline constexpr double max_dihedral_angle = 161.5;

/// Fills the inside of `shape` with tets of a body-centered cubic lattice with cells of `spacing` (m), fitted
/// to the surface.
///
/// The boundary is a closed manifold. Its nodes lie on the surface, except where the spacing does not resolve
/// it (walls and gaps of about a cell); there they may be off by up to 0.35 of the spacing. Sharp edges are
/// cut off by a fraction of a cell. If no node of the lattice lies inside, the mesh is empty. The result is
/// the same for any thread count.
TetMesh tetrahedralize(const LevelSet& shape, double spacing, CellSizes sizes = CellSizes::uniform);

/// Returns a spacing (m) that gives four cells across LevelSet::min_size() and at least ten along the
/// longest extent.
double default_spacing(const LevelSet& shape);

/// Returns the level set of a closed mesh that faces outward, in its own coordinates, for tetrahedralize().
/// Its grid has two cells for each `spacing` (m), between 64 and 256 along the longest extent; without a
/// spacing it has 64.
LevelSet fine_level_set(const TriangleMesh& mesh, std::optional<double> spacing);

}  // namespace duet
