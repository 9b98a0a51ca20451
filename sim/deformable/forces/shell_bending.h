// Makes the bending elements of shells from their rest shapes: springs on the curvature of each triangle.
#pragma once

#include <array>
#include <vector>

#include "sim/deformable/forces/springs.h"
#include "sim/geometry/mesh/sheets.h"

namespace duet {

/// The resistance to bending of one triangle: three springs on the components of its curvature. They share
/// the nodes of the triangle, of its neighbors and of theirs, which are at most 12.
using ShellBending = std::array<Spring<12>, 3>;

/// Returns the resistance to bending of a shell, one element for each triangle (global particle indices),
/// with the flexural rigidity D = E h^3 / (12 (1 - nu^2)) = `rigidity` (N m) and nu = `poisson_ratio`.
///
///     psi = D / 2 ((1 - nu) S : S + nu (tr S)^2) A,   S = 1/A sum_k s_k n_k n_k^T
///
/// S is the curvature (1/m) of a triangle of area A whose edges have the normals n_k in its plane. s_k is the
/// length of edge k times the angle between the triangle and the surface in the middle of the edge, as in the
/// element of Morley (1968). That angle is a sum of the bends across the edge and across the other edges of
/// both of its triangles, with weights that make S exact for every surface of constant curvature, whatever
/// the shapes of the triangles. A triangle on the border has no bend across its outer edge: it takes the
/// curvature of the least energy, that of a free edge without moment.
///
/// `edges` are those of the sheet (edges()), `rest` has the rest positions (m) of all particles. The rows of
/// Cholesky's factorization turn psi into a sum of three squares D / (2 A) (|d| - |d_0|)^2, where d is a sum
/// of positions and d_0 is d at rest. The viscosity is `damping` (s) times the stiffness.
std::vector<ShellBending> shell_bending(const std::vector<Triangle>& triangles,
                                        const std::vector<SheetEdge>& edges, const std::vector<Vec3>& rest,
                                        double rigidity, double poisson_ratio, double damping);

}  // namespace duet
