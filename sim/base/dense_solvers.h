// Decompositions and solves of small dense matrices with a fixed order of operations. Eigen's own solvers
// promise no order: it varies with the processor's vector width, the compiler and the version of Eigen. Code
// that feeds the state uses these solvers instead, so that its bits are the same everywhere.
#pragma once

#include <array>
#include <cmath>
#include <utility>

#include "sim/base/types.h"

namespace duet {

/// A square matrix of doubles with `n` rows and columns.
template <int n>
using SquareMatrix = Eigen::Matrix<double, n, n>;
/// A column vector of `n` doubles.
template <int n>
using ColumnVector = Eigen::Matrix<double, n, 1>;

/// Eigenvalues and eigenvectors of a symmetric matrix: A = Q diag(lambda) Q^T.
template <int n>
struct SymmetricEigen {
  ColumnVector<n> values;   ///< The eigenvalues lambda, in ascending order.
  SquareMatrix<n> vectors;  ///< Q, whose columns are orthonormal eigenvectors; det Q is 1 or -1.
};

/// Computes the eigenvalues and eigenvectors of a symmetric matrix by cyclic Jacobi rotations. Only the lower
/// triangle of `matrix` is read. Each rotation clears one off-diagonal entry; sweeps over all of them end
/// when the off-diagonal entries are rounding (Golub, Van Loan, Matrix Computations, section 8.5). The result
/// is accurate to rounding relative to the largest eigenvalue. NaN entries give NaN.
template <int n>
SymmetricEigen<n> symmetric_eigen(const SquareMatrix<n>& matrix) {
  // Bound on the number of sweeps. Convergence is quadratic, and 5 to 8 sweeps are usual.
  constexpr int max_sweeps = 20;
  SquareMatrix<n> A = matrix;
  SymmetricEigen<n> result;
  SquareMatrix<n>& Q = result.vectors;
  Q.setIdentity();
  for (int sweep = 0; sweep < max_sweeps; ++sweep) {
    double off_diagonal = 0, diagonal = 0;
    for (int i = 0; i < n; ++i) {
      diagonal += A(i, i) * A(i, i);
      for (int j = 0; j < i; ++j) off_diagonal += A(i, j) * A(i, j);
    }
    // The sums hold squares: 2^-110 is the square of 2^-55, a quarter of the unit roundoff 2^-53.
    if (!(off_diagonal > 0x1p-110 * diagonal)) break;
    for (int p = 0; p < n; ++p)
      for (int q = p + 1; q < n; ++q) {
        const double here = A(q, p);
        if (here == 0) continue;
        // t is the tangent of the smaller of the two rotation angles: t^2 + 2 theta t - 1 = 0.
        const double theta = (A(q, q) - A(p, p)) / (2 * here);
        const double t = (theta < 0 ? -1 : 1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        A(p, p) -= t * here;
        A(q, q) += t * here;
        A(q, p) = 0;
        for (int k = 0; k < n; ++k) {
          if (k != p && k != q) {
            double& kp = k > p ? A(k, p) : A(p, k);
            double& kq = k > q ? A(k, q) : A(q, k);
            const double before = kp;
            kp = c * before - s * kq;
            kq = s * before + c * kq;
          }
          const double before = Q(k, p);
          Q(k, p) = c * before - s * Q(k, q);
          Q(k, q) = s * before + c * Q(k, q);
        }
      }
  }
  for (int i = 0; i < n; ++i) result.values[i] = A(i, i);
  for (int i = 1; i < n; ++i)
    for (int j = i; j > 0 && result.values[j] < result.values[j - 1]; --j) {
      std::swap(result.values[j], result.values[j - 1]);
      for (int k = 0; k < n; ++k) std::swap(Q(k, j), Q(k, j - 1));
    }
  return result;
}

/// The factorization P A P^T = L D L^T of a symmetric positive semi-definite matrix A with diagonal pivoting.
/// Each pivot is the largest remaining diagonal entry. Where only pivots of rounding size remain, A counts as
/// singular: their unknowns are set to zero, so that a consistent singular system gets one of its solutions.
/// A default-constructed factor is that of the identity.
template <int n>
class SymmetricFactor {
 public:
  /// Constructs the factor of the identity.
  SymmetricFactor() = default;
  /// Factors `matrix`; see compute().
  explicit SymmetricFactor(const SquareMatrix<n>& matrix) { compute(matrix); }

  /// Replaces the factor by that of `matrix`, of which only the lower triangle is read.
  void compute(const SquareMatrix<n>& matrix) {
    L_ = matrix;
    ColumnVector<n> scale = L_.diagonal();
    for (int j = 0; j < n; ++j) {
      int pivot = j;
      for (int i = j + 1; i < n; ++i)
        if (L_(i, i) > L_(pivot, pivot)) pivot = i;
      row_[static_cast<std::size_t>(j)] = pivot;
      exchange(j, pivot);
      std::swap(scale[j], scale[pivot]);
      const double d = L_(j, j);
      inverse_pivot_[j] = d > rounding * scale[j] ? 1 / d : 0;
      for (int i = j + 1; i < n; ++i) {
        const double column = L_(i, j);
        L_(i, j) = column * inverse_pivot_[j];
        for (int k = j + 1; k <= i; ++k) L_(i, k) -= L_(i, j) * (k == i ? column : L_(k, j) * d);
      }
    }
  }

  /// Returns x with A x = `right_side`. If A is singular, the equations of the pivots that count as zero are
  /// ignored.
  ColumnVector<n> solve(const ColumnVector<n>& right_side) const {
    ColumnVector<n> x = right_side;
    for (int j = 0; j < n; ++j) std::swap(x[j], x[row_[static_cast<std::size_t>(j)]]);
    for (int j = 0; j < n; ++j)
      for (int i = j + 1; i < n; ++i) x[i] -= L_(i, j) * x[j];
    for (int j = 0; j < n; ++j) x[j] *= inverse_pivot_[j];
    for (int j = n; j-- > 0;)
      for (int i = j + 1; i < n; ++i) x[j] -= L_(i, j) * x[i];
    for (int j = n; j-- > 0;) std::swap(x[j], x[row_[static_cast<std::size_t>(j)]]);
    return x;
  }

  /// Returns A^-1, one column per solve. If A is singular, this is a generalized inverse.
  SquareMatrix<n> inverse() const {
    SquareMatrix<n> result;
    for (int j = 0; j < n; ++j) result.col(j) = solve(ColumnVector<n>::Unit(j));
    return result;
  }

 private:
  // Pivots at or below this fraction of their original diagonal entry count as zero. It is 4.5 times the
  // relative precision of a double (2.2e-16). A larger value would treat ill-conditioned matrices as
  // singular.
  static constexpr double rounding = 1e-15;

  // Exchanges rows and columns i < j of the lower triangle. Columns before i hold entries of L already.
  void exchange(int i, int j) {
    if (i == j) return;
    for (int k = 0; k < i; ++k) std::swap(L_(i, k), L_(j, k));
    for (int k = i + 1; k < j; ++k) std::swap(L_(k, i), L_(j, k));
    for (int k = j + 1; k < n; ++k) std::swap(L_(k, i), L_(k, j));
    std::swap(L_(i, i), L_(j, j));
  }

  // The unit lower triangular factor, below the diagonal. Its diagonal and upper triangle hold scratch
  // values.
  SquareMatrix<n> L_ = SquareMatrix<n>::Identity();
  // The diagonal of D^-1; 0 for pivots that count as zero.
  ColumnVector<n> inverse_pivot_ = ColumnVector<n>::Ones();
  // The permutation P as exchanges: step j exchanges j with row_[j].
  std::array<int, n> row_ = [] {
    std::array<int, n> same{};
    for (int i = 0; i < n; ++i) same[static_cast<std::size_t>(i)] = i;
    return same;
  }();
};

/// Returns A^-1 B by Gaussian elimination with partial pivoting. If A is singular, the result has entries
/// that are not finite.
template <int n>
SquareMatrix<n> solve_general(SquareMatrix<n> A, SquareMatrix<n> B) {
  for (int j = 0; j < n; ++j) {
    int pivot = j;
    for (int i = j + 1; i < n; ++i)
      if (std::abs(A(i, j)) > std::abs(A(pivot, j))) pivot = i;
    if (pivot != j)
      for (int k = 0; k < n; ++k) {
        std::swap(A(j, k), A(pivot, k));
        std::swap(B(j, k), B(pivot, k));
      }
    for (int i = j + 1; i < n; ++i) {
      const double factor = A(i, j) / A(j, j);
      for (int k = j + 1; k < n; ++k) A(i, k) -= factor * A(j, k);
      for (int k = 0; k < n; ++k) B(i, k) -= factor * B(j, k);
    }
  }
  for (int j = n; j-- > 0;)
    for (int k = 0; k < n; ++k) {
      for (int i = j + 1; i < n; ++i) B(j, k) -= A(j, i) * B(i, k);
      B(j, k) /= A(j, j);
    }
  return B;
}

}  // namespace duet
