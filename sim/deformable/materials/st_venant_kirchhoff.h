// St. Venant-Kirchhoff elasticity that survives inversion, written once for T = double and T = Pack.
//
//   psi = mu sum e_i^2 + lambda/2 (sum e_i)^2,   e_i = (s_i^2 - 1)/2                               J/m^3
//
// for the principal stretches s_i of F: the Green strain's quadratic energy. Compressed below s = 1/sqrt 3,
// where the stress of a squeezed bar has its peak, the plain model loses its stiffness and rests again inside
// out at s = -1; there the strain e continues along its tangent instead. The stress stays the exact gradient
// of an energy and grows with the compression throughout.
#pragma once

#include "sim/deformable/gradient_scatter.h"
#include "sim/deformable/materials/principal_stretches.h"

namespace duet {

struct StVenantKirchhoff {
  static constexpr double extrapolation_start = 0.57735026918962576;  // 1/sqrt 3

  // e and its derivatives at s.
  template <class T>
  struct Strain {
    T value, first, second;
  };
  template <class T>
  static Strain<T> strain(const T& s) {
    const T at = max_of(s, T{} + extrapolation_start);  // s, or where the tangent is anchored
    return {0.5 * (at * at - 1.0) + at * (s - at), at, select(s > T{} + extrapolation_start, T{} + 1.0, T{})};
  }

  template <class T>
  static T energy_density(const T& mu, const T& lambda, const Matrix3<T>& F) {
    T squares{}, trace{};
    for (const T& s : principal_stretches(F).stretch) {
      const T e = strain(s).value;
      squares += e * e;
      trace += e;
    }
    return mu * squares + 0.5 * lambda * trace * trace;
  }

  // First Piola-Kirchhoff stress.
  template <class T>
  static Matrix3<T> stress(const T& mu, const T& lambda, const Matrix3<T>& F) {
    const PrincipalStretches<T> p = principal_stretches(F);
    return along_stretches(p, derivatives(mu, lambda, p.stretch).first);
  }

  template <class T>
  static StretchDerivatives<T> derivatives(const T& mu, const T& lambda, const T (&s)[3]) {
    const Strain<T> e[3] = {strain(s[0]), strain(s[1]), strain(s[2])};
    const T pressure = lambda * (e[0].value + e[1].value + e[2].value);
    StretchDerivatives<T> psi;
    for (int i = 0; i < 3; ++i) {
      const T S = 2.0 * mu * e[i].value + pressure;  // second Piola-Kirchhoff stress
      psi.first[i] = S * e[i].first;
      for (int j = 0; j < 3; ++j) psi.second[i][j] = lambda * e[i].first * e[j].first;
      psi.second[i][i] += 2.0 * mu * e[i].first * e[i].first + S * e[i].second;
    }
    return psi;
  }

  // A bound on the square of the highest frequency of an element in state F, over its volume: the term of
  // mu is at most (3 s^2 - 1)/2 times as stiff for the largest stretch s, that of lambda s^2 + |tr E| times.
  template <class T>
  static T squared_frequency(const T& mu, const T& lambda, const Matrix3<T>& F,
                             const GradientScatter<T>& scatter) {
    const T largest = squared_spectral_norm(F);
    const T trace = 0.5 * (squared_norm(F) - 3.0);
    const T stiffening = max_of(max_of(0.5 * (3.0 * largest - 1.0), largest + abs_of(trace)), T{} + 1.0);
    return scatter.at_rest(mu, lambda) * stiffening;
  }
};

}  // namespace duet
