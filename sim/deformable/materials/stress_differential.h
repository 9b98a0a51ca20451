// Change of stress with the deformation gradient, dP = H : dF, with the Hessian H of the energy density
// projected to positive semi-definite. With it implicit integration descends in energy from every state.
// Written once for T = double and T = double8.
#pragma once

#include "sim/deformable/materials/principal_stretches.h"

namespace duet {

/// Hessian of an isotropic energy density in the axes of the principal stretches, projected to positive
/// semi-definite.
///
/// In D = U^T dF V the Hessian falls apart into a 3x3 matrix on the diagonal of D and a 2x2 matrix for each
/// pair D_ij, D_ji. The eigenvectors of a 2x2 matrix are a shear ("flip") and a rotation ("twist"). Pair k
/// has the two indices other than k. Source: Smith, de Goes, Kim 2019.
template <class T>
struct StressDifferential {
  Matrix3<T> U,      ///< rotation from the axes of the stretches to the world
      V;             ///< rotation from the axes of the stretches to the rest shape
  T diagonal[3][3];  ///< Pa, matrix on the diagonal of D; symmetric
  T same[3];         ///< Pa, response of D_ij to itself by pair: half of flip + twist
  T other[3];        ///< Pa, response of D_ij to D_ji by pair: half of flip - twist
};

// Quotients with smaller differences or sums of principal stretches (1 at rest) would only be rounding: flips
// use the limit for equal stretches below the first bound, twists divide by the second one instead of a
// smaller sum.
inline constexpr double min_stretch_difference = 1e-5,  ///< smallest difference of stretches to divide by
    min_stretch_sum = 1e-3;                             ///< smallest sum of stretches to divide by

/// Returns the projected Hessian at the stretches `p`, given the derivatives `psi` of the energy density by
/// them.
///
/// Negative eigenvalues are set to zero: those of the 3x3 matrix, of the flips and of the twists.
template <class T>
StressDifferential<T> stress_differential(const PrincipalStretches<T>& p, const StretchDerivatives<T>& psi) {
  StressDifferential<T> H;
  H.U = p.U;
  H.V = p.V;
  Matrix3<T> A;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) A[i][j] = psi.second[i][j];
  const Matrix3<T> Q = diagonalize(A);
  Matrix3<T> scaled;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) scaled[i][j] = Q[i][j] * max_of(A[j][j], T{});
  const Matrix3<T> positive = times_transposed(scaled, Q);
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) H.diagonal[k][j] = positive[k][j];
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    const T difference = p.stretch[i] - p.stretch[j], sum = p.stretch[i] + p.stretch[j];
    const auto apart = abs_of(difference) > T{} + min_stretch_difference;
    const T flip = select(apart, (psi.first[i] - psi.first[j]) / select(apart, difference, T{} + 1.0),
                          0.5 * (psi.second[i][i] + psi.second[j][j]) - psi.second[i][j]);
    const T twist = (psi.first[i] + psi.first[j]) / max_of(sum, T{} + min_stretch_sum);
    const T shear = max_of(flip, T{}), turn = max_of(twist, T{});
    H.same[k] = 0.5 * (shear + turn);
    H.other[k] = 0.5 * (shear - turn);
  }
  return H;
}

/// Returns H : dF, the change of the first Piola-Kirchhoff stress, Pa.
template <class T>
Matrix3<T> operator*(const StressDifferential<T>& H, const Matrix3<T>& dF) {
  const Matrix3<T> D = transposed_times(H.U, dF) * H.V;
  Matrix3<T> P;
  for (int k = 0; k < 3; ++k) {
    P[k][k] = H.diagonal[k][0] * D[0][0] + H.diagonal[k][1] * D[1][1] + H.diagonal[k][2] * D[2][2];
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    P[i][j] = H.same[k] * D[i][j] + H.other[k] * D[j][i];
    P[j][i] = H.same[k] * D[j][i] + H.other[k] * D[i][j];
  }
  return H.U * times_transposed(P, H.V);
}

}  // namespace duet
