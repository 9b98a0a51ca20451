// Principal stretches of a deformation gradient, and isotropic stress in terms of them. Written once for T =
// double and T = double8. Every material gives the derivatives of its energy by the stretches; stress and
// stress differential follow from them (Stomakhin et al. 2012; Smith, de Goes, Kim 2019, "Analytic
// eigensystems for isotropic distortion energies").
#pragma once

#include <initializer_list>

#include "sim/base/matrix3.h"

namespace duet {

/// Singular value decomposition with rotations: F = U diag(stretch) V^T.
///
/// stretch[0] >= stretch[1] >= |stretch[2]|, and det F has the sign of stretch[2]: inverted elements have a
/// negative smallest stretch.
template <class T>
struct PrincipalStretches {
  Matrix3<T> U,  ///< rotation from the axes of the stretches to the world
      V;         ///< rotation from the axes of the stretches to the rest shape
  T stretch[3];  ///< principal stretches, 1 at rest, in descending order
};

/// Derivatives of an energy density psi by the principal stretches.
template <class T>
struct StretchDerivatives {
  T first[3];      ///< Pa, psi_i
  T second[3][3];  ///< Pa, psi_ij; symmetric
};

/// Returns an upper bound on the largest eigenvalue of A^T A.
///
///     m + sqrt(2/3 (|G|^2 - 3 m^2)),   G = A^T A,   m = tr(G) / 3
///
/// The bound is exact if the two smaller eigenvalues are equal.
template <class T>
T squared_spectral_norm(const Matrix3<T>& A) {
  const Matrix3<T> G = transposed_times(A, A);
  const T mean = (G[0][0] + G[1][1] + G[2][2]) * (1.0 / 3);
  const T deviation = squared_norm(G) - 3.0 * mean * mean;
  return mean + sqrt_of(max_of(deviation, T{}) * (2.0 / 3));
}

/// Diagonalizes the symmetric matrix `A` in place by Jacobi's method and returns the rotation Q with A = Q
/// diag Q^T.
///
/// Five sweeps reduce the off-diagonal elements of any matrix to rounding. Their number is fixed, so that all
/// lanes of a pack do the same.
template <class T>
Matrix3<T> diagonalize(Matrix3<T>& A) {
  constexpr int sweeps = 5;
  Matrix3<T> Q{};
  for (int i = 0; i < 3; ++i) Q[i][i] = T{} + 1.0;
  for (int i = 0; i < 3 * sweeps; ++i) {
    const int p = i % 3 == 2 ? 1 : 0, q = i % 3 == 0 ? 1 : 2, r = 3 - p - q;
    // The rotation by the smaller angle, with tangent t, makes A_pq zero. The addend 1e-300 avoids 0/0 if it
    // is zero already and A_pp = A_qq.
    const T twice = A[p][q] + A[p][q], gap = A[q][q] - A[p][p];
    const T size = abs_of(gap) + sqrt_of(gap * gap + twice * twice) + 1e-300;
    const T t = select(gap < T{}, -twice, twice) / size;
    const T c = 1.0 / sqrt_of(1.0 + t * t), s = t * c;
    A[p][p] = A[p][p] - t * A[p][q];
    A[q][q] = A[q][q] + t * A[p][q];
    A[p][q] = A[q][p] = T{};
    const T rp = A[r][p], rq = A[r][q];
    A[r][p] = A[p][r] = c * rp - s * rq;
    A[r][q] = A[q][r] = s * rp + c * rq;
    for (int k = 0; k < 3; ++k) {
      const T kp = Q[k][p], kq = Q[k][q];
      Q[k][p] = c * kp - s * kq;
      Q[k][q] = s * kp + c * kq;
    }
  }
  return Q;
}

/// Parts of principal_stretches().
namespace detail {

/// Column of a 3x3 matrix.
template <class T>
struct Column {
  T x[3];  ///< the components
};
/// Returns column `j` (0 to 2) of `A`.
template <class T>
Column<T> column(const Matrix3<T>& A, int j) {
  return {{A[0][j], A[1][j], A[2][j]}};
}
/// Returns the scalar product of `a` and `b`.
template <class T>
T dot(const Column<T>& a, const Column<T>& b) {
  return a.x[0] * b.x[0] + a.x[1] * b.x[1] + a.x[2] * b.x[2];
}
/// Returns `a` scaled to length 1, or `otherwise` if `a` is not longer than `least`.
template <class T>
Column<T> normalized(const Column<T>& a, const T& least, const Column<T>& otherwise) {
  const T length = sqrt_of(dot(a, a));
  Column<T> unit;
  for (int i = 0; i < 3; ++i) unit.x[i] = select(length > least, a.x[i] / length, otherwise.x[i]);
  return unit;
}
/// Returns a unit vector that is perpendicular to the unit vector `a`.
template <class T>
Column<T> across(const Column<T>& a) {
  const auto steep = abs_of(a.x[0]) > T{} + 0.6;  // then the other two components are less than 0.8
  const T x = select(steep, a.x[1], T{}), y = select(steep, -a.x[0], a.x[2]), z = select(steep, T{}, -a.x[1]);
  const T length = sqrt_of(x * x + y * y + z * z);
  return {{x / length, y / length, z / length}};
}

}  // namespace detail

/// Computes the principal stretches of `F`, also for inverted, flat and zero matrices.
///
/// V diagonalizes F^T F. The columns of F V are orthogonal up to rounding; they are orthonormalized from the
/// longest on to give U.
template <class T>
PrincipalStretches<T> principal_stretches(const Matrix3<T>& F) {
  using detail::Column;
  Matrix3<T> G = transposed_times(F, F);
  PrincipalStretches<T> p;
  p.V = diagonalize(G);
  for (const int first : {0, 1, 0}) {  // sorts the columns: an exchanged pair has one column negated
    const int next = first + 1;
    const auto exchange = G[first][first] < G[next][next];
    const T larger = max_of(G[first][first], G[next][next]);
    G[next][next] = select(exchange, G[first][first], G[next][next]);
    G[first][first] = larger;
    for (int k = 0; k < 3; ++k) {
      const T a = p.V[k][first], b = p.V[k][next];
      p.V[k][first] = select(exchange, b, a);
      p.V[k][next] = select(exchange, -a, b);
    }
  }
  const Matrix3<T> B = F * p.V;
  const Column<T> b0 = detail::column(B, 0), b1 = detail::column(B, 1);
  const Column<T> axis{{T{} + 1.0, T{}, T{}}};
  // An element that is compressed to nothing has no direction: a column shorter than 1e-150 gets `axis`.
  const Column<T> u0 = detail::normalized(b0, T{} + 1e-150, axis);
  const T along = detail::dot(u0, b1);
  const Column<T> rest{{b1.x[0] - along * u0.x[0], b1.x[1] - along * u0.x[1], b1.x[2] - along * u0.x[2]}};
  p.stretch[0] = detail::dot(u0, b0);
  // Below 1e-14 of the largest stretch the second column is rounding, and any perpendicular direction does.
  const Column<T> u1 = detail::normalized(rest, 1e-14 * p.stretch[0] + 1e-150, detail::across(u0));
  p.stretch[1] = detail::dot(u1, b1);
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    p.U[k][0] = u0.x[k];
    p.U[k][1] = u1.x[k];
    p.U[k][2] = u0.x[i] * u1.x[j] - u0.x[j] * u1.x[i];
  }
  p.stretch[2] = detail::dot(detail::column(p.U, 2), detail::column(B, 2));
  return p;
}

/// Returns U diag(values) V^T: the stress (Pa) of a material whose energy density has the derivatives
/// `values` by the stretches.
template <class T>
Matrix3<T> along_stretches(const PrincipalStretches<T>& p, const T (&values)[3]) {
  Matrix3<T> scaled;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) scaled[i][j] = p.U[i][j] * values[j];
  return times_transposed(scaled, p.V);
}

}  // namespace duet
