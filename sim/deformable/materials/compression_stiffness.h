// The positive part of the stiffness that compression adds to an element. Such elements are damped in
// proportion to it. Written once for T = double, double8 and float8.
#pragma once

#include "sim/base/matrix3.h"

namespace duet {

/// Symmetric positive semi-definite operator H on changes dF of the deformation gradient.
///
///     dF.H dF = shear |sym l|^2 + bulk tr(l)^2,   l = dF F^-1
///
/// It vanishes for rotations of the element, so damping in proportion to it exerts no torque.
template <class T>
struct CompressionStiffness {
  /// F^-T, the inverse transpose of the deformation gradient; 1 at rest
  Matrix3<T> inverse;
  T shear,   ///< Pa, coefficient of |sym l|^2; Pa s where H is a viscosity
      bulk;  ///< Pa, coefficient of tr(l)^2; Pa s where H is a viscosity

  /// Returns H dF, in the unit of `shear` and `bulk`.
  Matrix3<T> operator*(const Matrix3<T>& dF) const {
    const Matrix3<T> l = times_transposed(dF, inverse);
    const T trace = bulk * (l[0][0] + l[1][1] + l[2][2]);
    Matrix3<T> S;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) S[i][j] = 0.5 * shear * (l[i][j] + l[j][i]);
    for (int i = 0; i < 3; ++i) S[i][i] = S[i][i] + trace;
    return S * inverse;
  }
};

}  // namespace duet
