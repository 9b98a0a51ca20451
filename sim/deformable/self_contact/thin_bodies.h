// Makes the springs of edges and the bending elements of rods from their rest shapes and moduli.
#pragma once

#include <array>
#include <vector>

#include "sim/deformable/forces/springs.h"

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

}  // namespace duet
