// Fills the inside of a cut BCC lattice with tets by the stencils of Labelle and Shewchuk 2007, "Isosurface
// Stuffing".
#pragma once

#include "sim/geometry/meshing/lattice_cuts.h"

namespace duet {

/// Returns the part of the lattice that lies inside, as tets. Neighboring tets of the lattice cut their
/// common faces alike.
TetMesh tets_inside(const CutLattice& cut);

}  // namespace duet
