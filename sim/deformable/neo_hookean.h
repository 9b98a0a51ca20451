// Neo-Hookean elasticity that survives inversion, written once for T = double and T = Pack.
//
//   psi(F) = mu/2 (|F|^2 - 3) + g(J),   J = det F,   g(J) = -mu ln J + lambda/2 (ln J)^2        J/m^3
//   P(F)   = mu F + g'(J) cof F                                                                   Pa
//
// Below J = 1/4, where the paper's elements extrapolate their stress along singular values, g continues as
// its own second-order Taylor polynomial. The stress then stays the exact gradient of an energy (the paper's
// is not), pushes every flattened or inverted element back, and needs no singular value decomposition.
#pragma once

#include "sim/base/simd.h"

namespace duet::neo_hookean {

inline constexpr double extrapolation_start = 0.25;  // least J for which the logarithm is used

// g and its derivatives at J.
template <class T>
struct Volumetric {
  T value, first, second;
};

template <class T>
Volumetric<T> volumetric(const T& mu, const T& lambda, const T& J) {
  const T start = T{} + extrapolation_start;
  const T at = select(J > start, J, start);  // J, or where the polynomial is anchored
  const T log = log_of(at);
  const T inverse = 1.0 / at;
  Volumetric<T> g;
  g.second = (lambda + mu - lambda * log) * inverse * inverse;
  const T slope = (lambda * log - mu) * inverse;
  const T below = J - at;
  g.first = slope + g.second * below;
  g.value = (0.5 * lambda * log - mu) * log + (slope + 0.5 * g.second * below) * below;
  return g;
}

template <class T>
T energy_density(const T& mu, const T& lambda, const Matrix3<T>& F) {
  const T J = determinant(F, cofactor(F));
  return 0.5 * mu * (squared_norm(F) - 3.0) + volumetric(mu, lambda, J).value;
}

// First Piola-Kirchhoff stress.
template <class T>
Matrix3<T> stress(const T& mu, const T& lambda, const Matrix3<T>& F) {
  const Matrix3<T> cof = cofactor(F);
  const T slope = volumetric(mu, lambda, determinant(F, cof)).first;
  Matrix3<T> P;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) P[i][j] = mu * F[i][j] + slope * cof[i][j];
  return P;
}

// Largest eigenvalue of the symmetric matrix A^T A, from above: its trace and norm bound it (exact when two
// are equal).
template <class T>
T squared_spectral_norm(const Matrix3<T>& A) {
  const Matrix3<T> G = transposed_times(A, A);
  const T mean = (G[0][0] + G[1][1] + G[2][2]) * (1.0 / 3);
  const T deviation = squared_norm(G) - 3.0 * mean * mean;
  return mean + sqrt_of(select(deviation > T{}, deviation, T{}) * (2.0 / 3));
}

// Stiffness of the element in state F over its stiffness at rest: scales the square of its highest frequency,
// so that the time step follows the compression that a blow causes. 1 at F = identity.
template <class T>
T stiffening(const T& mu, const T& lambda, const Matrix3<T>& F) {
  const Matrix3<T> cof = cofactor(F);
  const Volumetric<T> g = volumetric(mu, lambda, determinant(F, cof));
  const T slope = select(g.first > T{}, g.first, -g.first);
  const T stiffness = mu + g.second * squared_spectral_norm(cof) + slope * sqrt_of(squared_spectral_norm(F));
  return stiffness / (lambda + 3.0 * mu);
}

// Viscous stress for the velocity gradient Fdot: P = F (2 b Edot + a tr(Edot) I) with Edot = sym(F^T Fdot),
// the rate of the Green strain, and viscous moduli a = damping * lambda, b = damping * mu. Linear in Fdot,
// symmetric, dissipative, and unlike a law on the rotated F it keeps angular momentum exactly (P F^T is
// symmetric).
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

}  // namespace duet::neo_hookean
