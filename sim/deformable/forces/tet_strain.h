// How far tetrahedra are from their shapes at rest, whatever forces hold them together.
#pragma once

#include <vector>

#include "sim/deformable/forces/finite_elements.h"

namespace duet {

// x1 - x0, x2 - x0 and x3 - x0 as columns, m.
Mat3 edge_matrix(const Tet& tet, const std::vector<Vec3>& x);

// Takes the deformation gradients of `tets`, whose edge matrices at rest have the inverses `inverse_rest`
// (1/m), into what `strain` says of others; its worst_tet is one of `tets` then if none was worse.
void take_strain(const std::vector<Tet>& tets, const std::vector<Mat3>& inverse_rest,
                 const std::vector<Vec3>& x, FiniteElements::Strain& strain);
// See FiniteElements::add_strain.
void raise_strain(const std::vector<Tet>& tets, const std::vector<Mat3>& inverse_rest,
                  const std::vector<Vec3>& x, std::vector<float>& strain);

}  // namespace duet
