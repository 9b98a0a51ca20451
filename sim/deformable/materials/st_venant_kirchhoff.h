// St. Venant-Kirchhoff elasticity that recovers from inversion. Written once for T = double and T = double8.
//
//     psi = mu sum e_i^2 + lambda/2 (sum e_i)^2,   e_i = (s_i^2 - 1)/2                               J/m^3
//
// The s_i are the principal stretches of the deformation gradient F, so psi is quadratic in the Green strain.
// A bar that is compressed below s = 1/sqrt 3 would lose stiffness in the plain model, because its stress
// peaks there, and would come to rest again inside out at s = -1. Below that stretch the strain e continues
// along its tangent. So the stress remains the exact gradient of an energy and grows with the compression
// throughout.
#pragma once

#include "sim/deformable/gradient_scatter.h"
#include "sim/deformable/materials/principal_stretches.h"

namespace duet {

/// The Saint Venant-Kirchhoff material model; all functions take the Lamé parameters `mu` and `lambda` in Pa.
struct StVenantKirchhoff {
  /// Principal stretch below which the strain continues along its tangent: 1/sqrt 3, where the stress of a
  /// compressed bar peaks.
  static constexpr double extrapolation_start = 0.57735026918962576;

  /// Principal Green strain e and its derivatives by the stretch.
  template <class T>
  struct Strain {
    T value,     ///< e, 0 at rest
        first,   ///< e' = s, or extrapolation_start below it
        second;  ///< e'' = 1, or 0 below extrapolation_start
  };
  /// Returns e, e' and e'' at the principal stretch `s`, extrapolated below extrapolation_start.
  template <class T>
  static Strain<T> strain(const T& s) {
    // The tangent is anchored at extrapolation_start.
    const T at = max_of(s, T{} + extrapolation_start);
    return {0.5 * (at * at - 1.0) + at * (s - at), at, select(s > T{} + extrapolation_start, T{} + 1.0, T{})};
  }

  /// Returns the energy density psi at the deformation gradient `F`, J/m^3.
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

  /// Returns the first Piola-Kirchhoff stress at the deformation gradient `F`, Pa.
  template <class T>
  static Matrix3<T> stress(const T& mu, const T& lambda, const Matrix3<T>& F) {
    const PrincipalStretches<T> p = principal_stretches(F);
    return along_stretches(p, derivatives(mu, lambda, p.stretch).first);
  }

  /// Returns the first and second derivatives of psi by the principal stretches at `s`, Pa.
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

  /// Returns an upper bound on the square of the highest angular frequency of an element in state `F`,
  /// divided by its volume, rad^2/(s^2 m^3).
  ///
  /// For the largest stretch s, the term of mu is at most (3 s^2 - 1)/2 times as stiff as at rest, and the
  /// term of lambda at most s^2 + |tr E| times, with the Green strain E.
  template <class T>
  static T omega_squared(const T& mu, const T& lambda, const Matrix3<T>& F,
                         const GradientScatter<T>& scatter) {
    const T largest = squared_spectral_norm(F);
    const T trace = 0.5 * (squared_norm(F) - 3.0);
    const T stiffening = max_of(max_of(0.5 * (3.0 * largest - 1.0), largest + abs_of(trace)), T{} + 1.0);
    return scatter.at_rest(mu, lambda) * stiffening;
  }
};

}  // namespace duet
