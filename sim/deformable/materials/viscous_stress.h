// The viscosity of all materials. Written once for T = double, double8 and float8.
#pragma once

#include "sim/base/matrix3.h"

namespace duet {

/// Returns the factor by which stretch alone raises the viscous stress; the damping is divided by it.
///
///     |F|^2 / 3, limited to 1..16
///
/// This is the mean square of the principal stretches. Without the division an element stretched to several
/// times its length creeps back as many times too slowly. Compressed elements keep their damping (lower limit
/// 1). Beyond 16 more stretch again brings more damping, without which elements of 1e7 Pa that are let go at
/// 16 times their length blow up.
template <class T>
T excess_damping(const Matrix3<T>& F) {
  T square = T{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) square = square + F[i][j] * F[i][j];
  constexpr double least = 1, most = 16;
  return min_of(max_of(square * (1.0 / 3), T{} + least), T{} + most);
}

/// Returns the viscous first Piola-Kirchhoff stress (Pa) for a rate of the Green strain, the symmetric part
/// of `A` (1/s), at the deformation gradient `F`.
///
///     P = F (2 b sym(A) + a tr(A) 1),   a = damping lambda,   b = damping mu
///
/// `mu` and `lambda` are the elastic moduli (Pa) and `damping` (s) the ratio of viscous to elastic moduli.
template <class T>
Matrix3<T> stress_of_strain_rate(const T& mu, const T& lambda, const T& damping, const Matrix3<T>& F,
                                 const Matrix3<T>& A) {
  const T trace = damping * lambda * (A[0][0] + A[1][1] + A[2][2]);
  const T b = damping * mu;
  Matrix3<T> S;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) S[i][j] = b * (A[i][j] + A[j][i]);
  for (int i = 0; i < 3; ++i) S[i][i] = S[i][i] + trace;
  return F * S;
}

/// Returns the viscous first Piola-Kirchhoff stress (Pa) for the velocity gradient `Fdot` (1/s) at the
/// deformation gradient `F`: that of the strain rate sym(F^T Fdot).
///
/// The stress is linear in Fdot, symmetric and dissipative. Unlike a law on the rotated F it keeps angular
/// momentum exactly, because P F^T is symmetric.
template <class T>
Matrix3<T> viscous_stress(const T& mu, const T& lambda, const T& damping, const Matrix3<T>& F,
                          const Matrix3<T>& Fdot) {
  return stress_of_strain_rate(mu, lambda, damping, F, transposed_times(F, Fdot));
}

}  // namespace duet
