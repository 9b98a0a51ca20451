#include "sim/geometry/tetrahedralizer.h"

#include <algorithm>

#include "sim/geometry/lattice_stencils.h"

namespace duet {

TetMesh tetrahedralize(const LevelSet& shape, double spacing, bool graded) {
  return tets_inside(cut_lattice(bcc_lattice(shape, spacing, graded), shape));
}

double default_spacing(const LevelSet& shape) {
  return std::min(shape.smallest_size() / 4, (shape.upper() - shape.lower()).maxCoeff() / 10);
}

}  // namespace duet
