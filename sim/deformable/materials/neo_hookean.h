// Neo-Hookean elasticity that recovers from inversion. Written once for T = double and T = double8.
//
//     psi(F) = mu/2 (|F|^2 - 3) + g(J),   J = det F,   g(J) = -mu ln J + lambda/2 (ln J)^2        J/m^3
//     P(F)   = mu F + g'(J) cof F                                                                   Pa
//
// Below J = 1/4, g continues as its own second-order Taylor polynomial. (The elements that the paper used
// extrapolate their stress along singular values there.) So the stress remains the exact gradient of an
// energy, which the paper's is not, pushes every flattened or inverted element back, and needs no singular
// value decomposition.
#pragma once

#include "sim/deformable/gradient_scatter.h"
#include "sim/deformable/materials/compression_stiffness.h"
#include "sim/deformable/materials/principal_stretches.h"
#include "sim/deformable/materials/viscous_stress.h"

namespace duet {

/// The neo-Hookean material model; all functions take the Lamé parameters `mu` and `lambda` in Pa.
struct NeoHookean {
  /// Smallest J = det F at which the logarithm is used (1 at rest); the Taylor polynomial continues g below
  /// it.
  static constexpr double extrapolation_start = 0.25;

  /// The volume term g(J) of the energy density and its derivatives.
  template <class T>
  struct Volumetric {
    T value,     ///< g, J/m^3
        first,   ///< g', Pa
        second;  ///< g'', Pa
  };
  /// Returns g, g' and g'' at `J`, extrapolated below extrapolation_start.
  template <class T>
  static Volumetric<T> volumetric(const T& mu, const T& lambda, const T& J) {
    // The polynomial is anchored at extrapolation_start.
    const T at = max_of(J, T{} + extrapolation_start);
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

  /// Returns the energy density psi at the deformation gradient `F`, J/m^3.
  template <class T>
  static T energy_density(const T& mu, const T& lambda, const Matrix3<T>& F) {
    const T J = determinant(F, cofactor(F));
    return 0.5 * mu * (squared_norm(F) - 3.0) + volumetric(mu, lambda, J).value;
  }

  /// Returns the first Piola-Kirchhoff stress at the deformation gradient `F`, Pa.
  template <class T>
  static Matrix3<T> stress(const T& mu, const T& lambda, const Matrix3<T>& F) {
    const Matrix3<T> cof = cofactor(F);
    const T slope = volumetric(mu, lambda, determinant(F, cof)).first;
    return mu * F + slope * cof;
  }

  /// Returns the first and second derivatives of psi by the principal stretches at `s`, Pa.
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

  /// Returns an upper bound on the square of the highest angular frequency of an element in state `F`,
  /// divided by its volume, rad^2/(s^2 m^3).
  ///
  /// The time step follows the compression that an impact causes by this bound. The Hessian of the energy
  /// density is
  ///
  ///     mu |dF|^2 + g'' (cof F : dF)^2 + g' d2J,   d2J = ((cof F : dF)^2 - J^2 tr((dF F^-1)^2)) / J.
  ///
  /// -d2J is at most |F| |dF|^2, which is a tight bound where g'' is large (`apart` in the code). For
  /// positive J the first part of d2J can be combined with g'' (`together`). The remainder of d2J is then at
  /// most |dF|^2 times J |F^-1|^2 for g' < 0, and times |F| for g' > 0.
  template <class T>
  static T omega_squared(const T& mu, const T& lambda, const Matrix3<T>& F,
                         const GradientScatter<T>& scatter) {
    const Matrix3<T> cof = cofactor(F);
    const T J = determinant(F, cof), volume_part = scatter.of_part(cof);
    const Volumetric<T> g = volumetric(mu, lambda, J);
    const T norm = sqrt_of(squared_spectral_norm(F)), slope = abs_of(g.first);
    const T apart = g.second * volume_part + (mu + slope * norm) * scatter.largest;
    const T inverse = 1.0 / max_of(J, T{} + extrapolation_start);
    const T shear = select(T{} < g.first, norm, squared_spectral_norm(cof) * inverse);
    const T together = (g.second + g.first * inverse) * volume_part + (mu + slope * shear) * scatter.largest;
    // For g' > 0, which takes J > 1, only `together` is a bound.
    return select(J < T{} + extrapolation_start, apart,
                  select(T{} < g.first, together, min_of(apart, together)));
  }

  /// Returns the bound of omega_squared() for the stiffness without compression_stiffness(), divided by
  /// the element's volume, rad^2/(s^2 m^3).
  ///
  /// The remaining terms are mu |dF|^2 and the part of g' d2J that stretching makes (g' > 0) or that lies
  /// beyond the start of extrapolation.
  template <class T>
  static T uncompressed_omega_squared(const T& mu, const T& lambda, const Matrix3<T>& F,
                                      const GradientScatter<T>& scatter) {
    const T J = determinant(F, cofactor(F)), slope = volumetric(mu, lambda, J).first;
    const T rest = select(J < T{} + extrapolation_start, abs_of(slope), max_of(slope, T{}));
    return (mu + rest * sqrt_of(squared_spectral_norm(F))) * scatter.largest;
  }

  /// Returns a number r such that compression_stiffness() is at most r times the viscosity that
  /// `viscous_stress` makes with 1 s of damping; valid from J = 1/4 on.
  ///
  /// The viscosity includes the division by excess_damping(). With r seconds of damping it holds the
  /// stiffness of compression in steps of 1 s. In terms of the rate E = F^T sym(l) F of the Green strain and
  /// of G = (F^T F)^-1 = a 1 + D with trace-free D: tr(l) = a tr(E) + D : E, and |sym l| is at most |E| times
  /// the largest eigenvalue of G.
  template <class T>
  static T compression_over_viscosity(const T& mu, const T& lambda, const Matrix3<T>& F) {
    const Matrix3<T> cof = cofactor(F);
    const T J = max_of(determinant(F, cof), T{} + extrapolation_start);
    const Matrix3<T> JJG = transposed_times(cof, cof);
    const T scale = 1.0 / (J * J), a = (1.0 / 3) * scale * squared_norm(cof);
    const T off = max_of(scale * scale * squared_norm(JJG) - 3.0 * a * a, T{});  // |D|^2
    const T largest = a + sqrt_of((2.0 / 3) * off);
    const T shear = max_of(-J * volumetric(mu, lambda, J).first, T{});
    // A negative lambda reduces the viscosity, by |tr E|^2 <= 3 |E|^2, and is not counted in the stiffness.
    const T more = max_of(lambda, T{}), viscous_shear = 2.0 * mu + 3.0 * min_of(lambda, T{});
    const T held_by_shear = (shear * largest * largest + 2.0 * more * off) / viscous_shear;
    return excess_damping(F) * max_of(2.0 * a * a, held_by_shear);
  }

  /// Returns the positive part of what compression adds to the Hessian of the energy density.
  ///
  ///     J^2 (g'' + g'/J) tr(l)^2 - J g' tr(l^2),   l = dF F^-1
  ///
  /// The negative part, which is that of the spin in l, is left out. From the start of extrapolation on, l is
  /// divided by extrapolation_start instead of J, and only the shears of g' d2J are included.
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
