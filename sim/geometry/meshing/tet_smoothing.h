// Moves the nodes of a tet mesh so that its flattest tets get thicker: explicit elasticity steps as long as
// the smallest altitude allows.
#pragma once

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

// The altitude, as a part of the spacing, that smoothing stops at. That of an uncut tet of the lattice is
// 0.71.
inline constexpr double wanted_altitude = 0.4;

// Raises the altitudes of a mesh that fills `shape` with tets of a lattice of `spacing` (m), as far as moving
// single nodes can, up to wanted_altitude. Nodes of the boundary stay on the surface; those that are off it
// do not move. Dihedral angles keep the bounds of the tetrahedralizer. The same for any thread count.
void raise_altitudes(TetMesh& mesh, const LevelSet& shape, double spacing);

}  // namespace duet
