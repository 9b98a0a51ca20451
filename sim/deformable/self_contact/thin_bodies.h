// Makes the springs of shells, rods and mass-spring volumes from their rest shapes and moduli.
#pragma once

#include <array>
#include <vector>

#include "sim/deformable/forces/springs.h"
#include "sim/geometry/mesh/sheets.h"

namespace duet {

/// Returns a spring between the particles `a` and `b`, whose rest length is their distance in `rest` (m).
///
/// `modulus` (N) is its force at 100 % strain, `fraction` its fraction of critical damping for the given
/// inverse masses (1/kg).
Spring<2> edge_spring(int a, int b, const std::vector<Vec3>& rest, double modulus, double fraction,
                      const std::vector<double>& inverse_mass);

/// Returns a piece of a rod between the particles `a` and `b` with the axial stiffness EA = `modulus` (N).
///
/// Its viscosity is `damping` (s) times its stiffness.
Spring<2> rod_element(int a, int b, const std::vector<Vec3>& rest, double modulus, double damping);

/// Returns the resistance to bending of a rod at `node` between two pieces, with the bending stiffness EI =
/// `rigidity` (N m^2).
///
///     psi = EI / l (|c| - |c_0|)^2,   c = t_2 - t_1,   l = l_1 + l_2
///
/// The t_i are the vectors along the two pieces, divided by their lengths l_i at rest, and c_0 is c at rest.
/// The viscosity is `damping` (s) times the stiffness.
Spring<4> rod_bending(int before, int node, int after, const std::vector<Vec3>& rest, double rigidity,
                      double damping);

/// Returns the resistance to bending of a shell across an inner edge (global particle indices), with the
/// flexural rigidity D = E h^3 / (12 (1 - nu^2)) = `rigidity` (N m).
///
///     psi = D / (2 A) (|K| - |K_0|)^2,   K = sum w_i x_i
///
/// The weights w_i are cotangents of the angles at rest, A is the area of both triangles and K_0 is K at
/// rest. K is the discrete mean curvature of Bergou, Wardetzky, Harmon, Zorin, Grinspun (2006). If a sheet is
/// rolled up without stretching, the fractions of its curvature that its edges see have squares that add up
/// to 3 times the square of the whole, along any direction of equilateral triangles; their stiffness is
/// divided by that. The viscosity is `damping` (s) times the stiffness.
Spring<4> shell_bending(const SheetEdge& edge, const std::vector<Vec3>& rest, double rigidity,
                        double damping);

}  // namespace duet
