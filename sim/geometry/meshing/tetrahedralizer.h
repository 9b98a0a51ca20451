// Tetrahedral meshes of the inside of level sets by isosurface stuffing: Labelle and Shewchuk, Isosurface
// Stuffing: Fast Tetrahedral Meshes with Good Dihedral Angles (SIGGRAPH 2007).
#pragma once

#include <optional>

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/mesh/tet_mesh.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

// The dihedral angles that every mesh keeps, whatever the level set: those of the worst cut that the stencils
// can meet.
inline constexpr double least_dihedral_angle = 9.5;      // degrees
inline constexpr double largest_dihedral_angle = 161.5;  // degrees

// Fills the inside of `shape` with tets of a body-centred cubic lattice with cells of `spacing` (m), fitted
// to the surface. `graded`: cells double in size with their depth below the surface, which keeps its
// resolution.
//
// The boundary is a closed manifold. Its nodes lie on the surface, but for places that the spacing does not
// resolve (walls and gaps of about a cell), where they may be off by up to 0.35 of it. Sharp edges are
// cut off by a fraction of a cell. Without a cell inside, the mesh is empty. The same for any thread count.
TetMesh tetrahedralize(const LevelSet& shape, double spacing, bool graded = false);

// A spacing that gives four cells across the thickest part and at least ten along the longest extent.
double default_spacing(const LevelSet& shape);

// The level set of a closed mesh that faces outward, in its own coordinates: with two cells of its grid to
// one of `spacing` (m), as far as memory allows.
LevelSet fine_level_set(const TriangleMesh& mesh, std::optional<double> spacing);

}  // namespace duet
