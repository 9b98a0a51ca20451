// Neo-Hookean elasticity that survives inversion, written once for T = double and T = Pack.
//
//   psi(F) = mu/2 (|F|^2 - 3) + g(J),   J = det F,   g(J) = -mu ln J + lambda/2 (ln J)^2        J/m^3
//   P(F)   = mu F + g'(J) cof F                                                                   Pa
//
// Below J = 1/4, where the paper's elements extrapolate their stress along singular values, g continues as
// its own second-order Taylor polynomial. The stress then stays the exact gradient of an energy (the paper's
// is not), pushes every flattened or inverted element back, and needs no singular value decomposition.
#pragma once

#include "sim/deformable/principal_stretches.h"

namespace duet {

struct NeoHookean {
  static constexpr double extrapolation_start = 0.25;  // least J for which the logarithm is used

  // g and its derivatives at J.
  template <class T>
  struct Volumetric {
    T value, first, second;
  };
  template <class T>
  static Volumetric<T> volumetric(const T& mu, const T& lambda, const T& J) {
    const T at = max_of(J, T{} + extrapolation_start);  // J, or where the polynomial is anchored
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
  static T energy_density(const T& mu, const T& lambda, const Matrix3<T>& F) {
    const T J = determinant(F, cofactor(F));
    return 0.5 * mu * (squared_norm(F) - 3.0) + volumetric(mu, lambda, J).value;
  }

  // First Piola-Kirchhoff stress.
  template <class T>
  static Matrix3<T> stress(const T& mu, const T& lambda, const Matrix3<T>& F) {
    const Matrix3<T> cof = cofactor(F);
    const T slope = volumetric(mu, lambda, determinant(F, cof)).first;
    return mu * F + slope * cof;
  }

  template <class T>
  static StretchDerivatives<T> derivatives(const T& mu, const T& lambda, const T (&s)[3]) {
    const T cof[3] = {s[1] * s[2], s[2] * s[0], s[0] * s[1]};
    const Volumetric<T> g = volumetric(mu, lambda, s[0] * cof[0]);
    StretchDerivatives<T> psi;
    for (int i = 0; i < 3; ++i) {
      psi.first[i] = mu * s[i] + g.first * cof[i];
      for (int j = 0; j < 3; ++j)
        psi.second[i][j] = g.second * cof[i] * cof[j] + (i == j ? mu : g.first * s[3 - i - j]);
    }
    return psi;
  }

  // Stiffness of the element in state F over its stiffness at rest: scales the square of its highest
  // frequency, so that the time step follows the compression that a blow causes. 1 at F = identity.
  template <class T>
  static T stiffening(const T& mu, const T& lambda, const Matrix3<T>& F) {
    const Matrix3<T> cof = cofactor(F);
    const Volumetric<T> g = volumetric(mu, lambda, determinant(F, cof));
    const T stiffness =
        mu + g.second * squared_spectral_norm(cof) + abs_of(g.first) * sqrt_of(squared_spectral_norm(F));
    return stiffness / (lambda + 3.0 * mu);
  }
};

}  // namespace duet
