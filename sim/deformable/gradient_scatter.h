// What the shape of an element and the masses of its nodes make of a stiffness, for bounds on frequencies;
// written once for T = double and T = Pack.
#pragma once

#include "sim/base/matrix3.h"

namespace duet {

// S = sum of g g^T / m over the nodes of an element, with the gradients g (1/m) of their linear functions and
// their masses m (kg): the energy density 1/2 dF.H dF that displacements u make, with dF = sum of u g^T, is
// at most 1/2 c e sum of m |u|^2 where H <= c, with the largest eigenvalue e of S; and 1/2 c tr(A S A^T) sum
// of m |u|^2 where dF.H dF <= c (A : dF)^2.
template <class T>
struct GradientScatter {
  Matrix3<T> S;  // 1/(kg m^2)
  T largest;     // its largest eigenvalue

  T trace() const { return S[0][0] + S[1][1] + S[2][2]; }
  T of_part(const Matrix3<T>& A) const {  // tr(A S A^T)
    const Matrix3<T> AS = A * S;
    T sum = T{};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) sum = sum + AS[i][j] * A[i][j];
    return sum;
  }
  // Of an element at rest with these moduli, over its volume: the square of its highest frequency at most.
  T at_rest(const T& mu, const T& lambda) const { return lambda * trace() + 2.0 * mu * largest; }
};

}  // namespace duet
