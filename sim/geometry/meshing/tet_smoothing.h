// Moves the nodes of a tetrahedral mesh so that its flattest tets get thicker, because the smallest altitude
// limits the time step of explicit elasticity.
#pragma once

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// The altitude, as a fraction of the lattice spacing, from which on tets are thick enough. An uncut tet of
/// the lattice has 0.71. A larger value moves more nodes.
inline constexpr double wanted_altitude = 0.4;

/// Raises the altitudes of a mesh that fills `shape` with tets of a lattice of `spacing` (m), up to
/// `wanted_altitude` and as far as moving single nodes can. Nodes of the boundary stay on the surface;
/// boundary nodes that are off it do not move. Dihedral angles keep the bounds of tetrahedralize(). The
/// result is the same for any thread count.
void raise_altitudes(TetMesh& mesh, const LevelSet& shape, double spacing);

}  // namespace duet
