// The springs that shells, rods and mass-spring volumes are made of, from their rest shapes and moduli.
#pragma once

#include <array>
#include <vector>

#include "sim/deformable/forces/springs.h"
#include "sim/geometry/mesh/sheets.h"

namespace duet {

// A spring between the particles `a` and `b` at their distance in `rest` (m), whose force is `modulus` (N) at
// 100 % strain; damped `fraction` times critically on the particles' masses.
Spring<2> edge_spring(int a, int b, const std::vector<Vec3>& rest, double modulus, double fraction,
                      const std::vector<double>& inverse_mass);

// A piece of a rod of the axial stiffness EA = `modulus` (N), with the viscosity `damping` (s) times it.
Spring<2> rod_element(int a, int b, const std::vector<Vec3>& rest, double modulus, double damping);

// Bending of a rod at `node` between two pieces, of the bending stiffness EI = `rigidity` (N m^2): the change
// of direction per length against that at rest.
Spring<4> rod_bending(int before, int node, int after, const std::vector<Vec3>& rest, double rigidity,
                      double damping);

// Bending of a shell across an inner edge (global particle indices), of the flexural rigidity
// D = E h^3 / (12 (1 - nu^2)) (N m): the discrete mean curvature of Bergou, Wardetzky, Harmon, Zorin,
// Grinspun (2006) against that at rest. Of the curvature of a sheet that is rolled up without stretching, its
// edges see shares whose squares add up to 3 times the square of the whole, along any direction of
// equilateral triangles; the stiffness is divided by that.
Spring<4> shell_bending(const SheetEdge& edge, const std::vector<Vec3>& rest, double rigidity,
                        double damping);

}  // namespace duet
