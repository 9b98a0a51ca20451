// Viscosity of all materials, written once for T = double and T = Pack.
#pragma once

#include "sim/base/matrix3.h"

namespace duet {

// What takes the part that the stretch F has in the viscous stress away again: divide the damping by it, or
// an element drawn out to a multiple of its length creeps back many times too slowly. It is the mean square
// of the stretches, |F|^2 / 3, from 1 (crushed elements keep what they have) to 16: beyond, more stretch
// again brings more damping, without which elements of 1e7 Pa that are let go at 16 times their length blow
// up.
template <class T>
T excess_damping(const Matrix3<T>& F) {
  T square = T{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) square = square + F[i][j] * F[i][j];
  constexpr double least = 1, most = 16;
  return min_of(max_of(square * (1.0 / 3), T{} + least), T{} + most);
}

// Viscous stress (Pa) for the velocity gradient Fdot (1/s): P = F (2 b Edot + a tr(Edot) I) with Edot =
// sym(F^T Fdot), the rate of the Green strain, and viscous moduli a = damping * lambda, b = damping * mu.
// Linear in Fdot, symmetric, dissipative, and unlike a law on the rotated F it keeps angular momentum exactly
// (P F^T is symmetric).
template <class T>
Matrix3<T> viscous_stress(const T& mu, const T& lambda, const T& damping, const Matrix3<T>& F,
                          const Matrix3<T>& Fdot) {
  const Matrix3<T> A = transposed_times(F, Fdot);
  const T trace = damping * lambda * (A[0][0] + A[1][1] + A[2][2]);
  const T b = damping * mu;
  Matrix3<T> S;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) S[i][j] = b * (A[i][j] + A[j][i]);
  for (int i = 0; i < 3; ++i) S[i][i] = S[i][i] + trace;
  return F * S;
}

}  // namespace duet
