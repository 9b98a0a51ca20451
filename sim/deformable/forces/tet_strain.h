// Measures how far tetrahedra are from their shapes at rest, whatever forces hold them together.
#pragma once

#include <vector>

#include "sim/deformable/forces/finite_elements.h"

namespace duet {

/// Returns the matrix with the columns x1 - x0, x2 - x0 and x3 - x0 of a tetrahedron (m).
Mat3 edge_matrix(const Tet& tet, const std::vector<Vec3>& x);

/// Merges the statistics of `tets` at the positions `x` (m) into `strain`, which may hold those of other
/// tetrahedra.
///
/// `inverse_rest` has the inverses of their edge matrices at rest (1/m). If none was worse before,
/// `strain.worst_tet` becomes an index into `tets`.
void take_strain(const std::vector<Tet>& tets, const std::vector<Mat3>& inverse_rest,
                 const std::vector<Vec3>& x, FiniteElements::Strain& strain);
/// Raises each particle's entry of `strain` to the largest |stretch - 1| of the `tets` around it, or sets it
/// to FiniteElements::inverted, see FiniteElements::add_strain().
void raise_strain(const std::vector<Tet>& tets, const std::vector<Mat3>& inverse_rest,
                  const std::vector<Vec3>& x, std::vector<float>& strain);

}  // namespace duet
