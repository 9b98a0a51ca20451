// Corotated elasticity: linear in the stretches of the element and in its change of volume (the "fixed
// corotated" model of Stomakhin, Howes, Schroeder, Teran 2012). Written once for T = double and T = double8.
//
//     psi = mu sum (s_i - 1)^2 + lambda/2 (J - 1)^2,   J = s_1 s_2 s_3                              J/m^3
//     P   = 2 mu (F - R) + lambda (J - 1) cof F                                                      Pa
//
// The s_i are the principal stretches of the deformation gradient F, and R is the rotation nearest to F. Both
// terms are finite and grow with the distance from rest for flattened and inverted elements too, so nothing
// needs to be extrapolated.
#pragma once

#include "sim/deformable/gradient_scatter.h"
#include "sim/deformable/materials/principal_stretches.h"

namespace duet {

/// The fixed corotated material model; all functions take the Lamé parameters `mu` and `lambda` in Pa.
struct Corotated {
  /// Returns the energy density psi at the deformation gradient `F`, J/m^3.
  template <class T>
  static T energy_density(const T& mu, const T& lambda, const Matrix3<T>& F) {
    const PrincipalStretches<T> p = principal_stretches(F);
    T distance{}, J = p.stretch[0] * p.stretch[1] * p.stretch[2];
    for (const T& s : p.stretch) distance += (s - 1.0) * (s - 1.0);
    return mu * distance + 0.5 * lambda * (J - 1.0) * (J - 1.0);
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
    const T cof[3] = {s[1] * s[2], s[2] * s[0], s[0] * s[1]};
    const T pressure = lambda * (s[0] * cof[0] - 1.0);
    StretchDerivatives<T> psi;
    for (int i = 0; i < 3; ++i) {
      psi.first[i] = 2.0 * mu * (s[i] - 1.0) + pressure * cof[i];
      for (int j = 0; j < 3; ++j)
        psi.second[i][j] = lambda * cof[i] * cof[j] + (i == j ? 2.0 * mu : pressure * s[3 - i - j]);
    }
    return psi;
  }

  /// Returns an upper bound on the square of the highest angular frequency of an element in state `F`,
  /// divided by its volume, rad^2/(s^2 m^3).
  ///
  /// The term of mu is nowhere stiffer than at rest. The term of lambda is at most |cof F|^2 + 2 |J - 1| |F|
  /// times as stiff as at rest, and its fraction of the stiffness at rest is at most 3 lambda / (2 mu + 3
  /// lambda).
  template <class T>
  static T omega_squared(const T& mu, const T& lambda, const Matrix3<T>& F,
                         const GradientScatter<T>& scatter) {
    const Matrix3<T> cof = cofactor(F);
    const T change = abs_of(determinant(F, cof) - 1.0);
    const T volumetric = squared_spectral_norm(cof) + 2.0 * change * sqrt_of(squared_spectral_norm(F));
    const T share = 3.0 * lambda / (2.0 * mu + 3.0 * lambda);
    return scatter.at_rest(mu, lambda) * (1.0 + abs_of(share) * max_of(volumetric - 1.0, T{}));
  }
};

}  // namespace duet
