// Bounds on the frequencies of an element from its shape and the masses of its nodes. Written once for T =
// double and T = double8.
#pragma once

#include "sim/base/matrix3.h"

namespace duet {

/// Matrix that turns bounds on the stiffness of an element into bounds on its frequencies.
///
///     S = sum over the nodes of g g^T / m
///
/// g (1/m) is the gradient of a node's linear shape function and m (kg) the node's mass. Displacements u of
/// the nodes make dF = sum u g^T. If dF.H dF is at most c |dF|^2, the energy density 1/2 dF.H dF is at most
/// 1/2 c e sum m |u|^2, where e is the largest eigenvalue of S. If dF.H dF is at most c (A : dF)^2, it is at
/// most 1/2 c tr(A S A^T) sum m |u|^2.
template <class T>
struct GradientScatter {
  Matrix3<T> S;  ///< 1/(kg m^2), the matrix S
  T largest;     ///< 1/(kg m^2), the largest eigenvalue of S

  /// Returns tr(S), 1/(kg m^2).
  T trace() const { return S[0][0] + S[1][1] + S[2][2]; }
  /// Returns tr(A S A^T), the factor for a stiffness that resists only the component A : dF.
  T of_part(const Matrix3<T>& A) const {
    const Matrix3<T> AS = A * S;
    T sum = T{};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) sum = sum + AS[i][j] * A[i][j];
    return sum;
  }
  /// Returns an upper bound on the square of the element's highest angular frequency at rest, divided by the
  /// element's volume, rad^2/(s^2 m^3).
  ///
  ///     lambda tr(S) + 2 mu e
  ///
  /// `mu` and `lambda` are the Lamé parameters (Pa).
  T at_rest(const T& mu, const T& lambda) const { return lambda * trace() + 2.0 * mu * largest; }
};

}  // namespace duet
