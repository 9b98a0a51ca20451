// Neo-Hookean elasticity that survives inversion, written once for T = double and T = Pack.
//
//   psi(F) = mu/2 (|F|^2 - 3) + g(J),   J = det F,   g(J) = -mu ln J + lambda/2 (ln J)^2        J/m^3
//   P(F)   = mu F + g'(J) cof F                                                                   Pa
//
// Below J = 1/4, where the paper's elements extrapolate their stress along singular values, g continues as
// its own second-order Taylor polynomial. The stress then stays the exact gradient of an energy (the paper's
// is not), pushes every flattened or inverted element back, and needs no singular value decomposition.
#pragma once

#include "sim/deformable/gradient_scatter.h"
#include "sim/deformable/materials/compression_stiffness.h"
#include "sim/deformable/materials/principal_stretches.h"
#include "sim/deformable/materials/viscous_stress.h"

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

  // A bound on the square of the highest frequency of an element in state F, over its volume, so that the
  // time step follows the compression that a blow causes. The Hessian of the energy is
  //   mu |dF|^2 + g'' (cof F : dF)^2 + g' d2J,   d2J = ((cof F : dF)^2 - J^2 tr((dF F^-1)^2)) / J.
  // -d2J is at most |F| |dF|^2, which is good where g'' is great; where J > 0 and the first part of d2J is
  // taken together with g'', what remains is at most J |F^-1|^2 |dF|^2, or with the other sign |F| |dF|^2.
  template <class T>
  static T squared_frequency(const T& mu, const T& lambda, const Matrix3<T>& F,
                             const GradientScatter<T>& scatter) {
    const Matrix3<T> cof = cofactor(F);
    const T J = determinant(F, cof), volume_part = scatter.of_part(cof);
    const Volumetric<T> g = volumetric(mu, lambda, J);
    const T norm = sqrt_of(squared_spectral_norm(F)), slope = abs_of(g.first);
    const T apart = g.second * volume_part + (mu + slope * norm) * scatter.largest;
    const T inverse = 1.0 / max_of(J, T{} + extrapolation_start);
    const T shear = select(T{} < g.first, norm, squared_spectral_norm(cof) * inverse);
    const T together = (g.second + g.first * inverse) * volume_part + (mu + slope * shear) * scatter.largest;
    // With g' > 0 (which takes J > 1) only the second is one.
    return select(J < T{} + extrapolation_start, apart,
                  select(T{} < g.first, together, min_of(apart, together)));
  }

  // The same without compression_stiffness, which is dealt with: mu |dF|^2, and of g' d2J what stretches (g'
  // > 0) or has been crushed beyond the start of extrapolation.
  template <class T>
  static T soft_squared_frequency(const T& mu, const T& lambda, const Matrix3<T>& F,
                                  const GradientScatter<T>& scatter) {
    const T J = determinant(F, cofactor(F)), slope = volumetric(mu, lambda, J).first;
    const T rest = select(J < T{} + extrapolation_start, abs_of(slope), max_of(slope, T{}));
    return (mu + rest * sqrt_of(squared_spectral_norm(F))) * scatter.largest;
  }

  // How many seconds of viscosity (viscous_stress.h) hold compression_stiffness for a second each, at most;
  // from J = 1/4 on. With the rate E = F^T sym(l) F of the Green strain, and G = (F^T F)^-1 = a 1 + D with
  // the trace-free part D, tr(l) = a tr(E) + D : E, and |sym l| is at most |E| times the largest eigenvalue
  // of G.
  template <class T>
  static T compression_over_viscosity(const T& mu, const T& lambda, const Matrix3<T>& F) {
    const Matrix3<T> cof = cofactor(F);
    const T J = max_of(determinant(F, cof), T{} + extrapolation_start);
    const Matrix3<T> JJG = transposed_times(cof, cof);
    const T scale = 1.0 / (J * J), a = (1.0 / 3) * scale * squared_norm(cof);
    const T off = max_of(scale * scale * squared_norm(JJG) - 3.0 * a * a, T{});  // |D|^2
    const T largest = a + sqrt_of((2.0 / 3) * off);
    const T shear = max_of(-J * volumetric(mu, lambda, J).first, T{});
    // A negative lambda takes from the viscosity, |tr E|^2 <= 3 |E|^2, and is not counted in the stiffness.
    const T more = max_of(lambda, T{}), viscous_shear = 2.0 * mu + 3.0 * min_of(lambda, T{});
    const T held_by_shear = (shear * largest * largest + 2.0 * more * off) / viscous_shear;
    return excess_damping(F) * max_of(2.0 * a * a, held_by_shear);
  }

  // What compression adds to the Hessian, J^2 (g'' + g'/J) tr(l)^2 - J g' tr(l^2) with l = dF F^-1, but for
  // its negative part, which is that of the spin in l. From the start of extrapolation on, l is taken over
  // that J, and of g' d2J only the part of the shears is here.
  template <class T>
  static CompressionStiffness<T> compression_stiffness(const T& mu, const T& lambda, const Matrix3<T>& F) {
    const Matrix3<T> cof = cofactor(F);
    const T J = determinant(F, cof), at = max_of(J, T{} + extrapolation_start);
    const Volumetric<T> g = volumetric(mu, lambda, J);
    const T with_slope = select(J < T{} + extrapolation_start, T{}, J * g.first);
    return {(1.0 / at) * cof, at * max_of(-g.first, T{}), at * at * g.second + with_slope};
  }
};

}  // namespace duet
