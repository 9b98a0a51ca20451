// The inside of a cut BCC lattice as tets: the stencils of Labelle and Shewchuk, Isosurface Stuffing (2007).
#pragma once

#include "sim/geometry/meshing/lattice_cuts.h"

namespace duet {

// The tets of the lattice as far as they lie inside; neighbours cut their common faces alike.
TetMesh tets_inside(const CutLattice& cut);

}  // namespace duet
