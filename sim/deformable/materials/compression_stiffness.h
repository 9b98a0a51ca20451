// The positive part of what compression adds to the stiffness of an element, by itself: what such elements
// are damped in proportion to. Written once for T = double, Pack and PackF.
#pragma once

#include "sim/base/matrix3.h"

namespace duet {

// dF.H dF = shear |sym l|^2 + bulk tr(l)^2 with l = dF F^-1: of no size for the spin of the element, so that
// damping in proportion to it makes no torque.
template <class T>
struct CompressionStiffness {
  Matrix3<T> inverse;  // F^-T
  T shear, bulk;       // Pa

  // H dF, Pa.
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
