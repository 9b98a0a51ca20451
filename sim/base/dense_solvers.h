// Decompositions of small matrices. Their operations come in one order, whatever the processor's vectors, the
// compiler and the version of Eigen, whose own ones promise none; so they are what feeds the state may use.
#pragma once

#include <array>
#include <cmath>
#include <utility>

#include "sim/base/types.h"

namespace duet {

template <int n>
using SquareMatrix = Eigen::Matrix<double, n, n>;
template <int n>
using ColumnVector = Eigen::Matrix<double, n, 1>;

/// A = vectors diag(values) vectors^T, values ascending, vectors orthonormal (of either handedness).
template <int n>
struct SymmetricEigen {
  ColumnVector<n> values;
  SquareMatrix<n> vectors;
};

/// Eigenvalues and eigenvectors of the symmetric matrix A, of which the lower triangle is read, by Jacobi's
/// method: cyclic rotations, each clearing one entry off the diagonal, until they are rounding (Golub, Van
/// Loan, Matrix Computations, section 8.5). Accurate to rounding relative to the largest eigenvalue. NaN
/// entries give NaN.
template <int n>
SymmetricEigen<n> symmetric_eigen(const SquareMatrix<n>& matrix) {
  constexpr int most_sweeps = 20;  // it converges quadratically: 5 to 8 are usual
  SquareMatrix<n> A = matrix;
  SymmetricEigen<n> result;
  SquareMatrix<n>& Q = result.vectors;
  Q.setIdentity();
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    double off_diagonal = 0, diagonal = 0;
    for (int i = 0; i < n; ++i) {
      diagonal += A(i, i) * A(i, i);
      for (int j = 0; j < i; ++j) off_diagonal += A(i, j) * A(i, j);
    }
    if (!(off_diagonal > 0x1p-110 * diagonal)) break;
    for (int p = 0; p < n; ++p)
      for (int q = p + 1; q < n; ++q) {
        const double here = A(q, p);
        if (here == 0) continue;
        // t = tan of the smaller angle of rotation: t^2 + 2 theta t - 1 = 0
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

/// P A P^T = L D L^T of a symmetric positive semi-definite matrix A, of which the lower triangle is read,
/// with the largest remaining diagonal entry as each pivot. Where no pivot is left but rounding, the matrix
/// is taken for singular: solutions have nothing along what remains.
template <int n>
class SymmetricFactor {
 public:
  SymmetricFactor() = default;
  explicit SymmetricFactor(const SquareMatrix<n>& matrix) { compute(matrix); }

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

  SquareMatrix<n> inverse() const {
    SquareMatrix<n> result;
    for (int j = 0; j < n; ++j) result.col(j) = solve(ColumnVector<n>::Unit(j));
    return result;
  }

 private:
  static constexpr double rounding = 1e-15;

  // Exchanges rows and columns i < j of the lower triangle, columns before i being those of L already.
  void exchange(int i, int j) {
    if (i == j) return;
    for (int k = 0; k < i; ++k) std::swap(L_(i, k), L_(j, k));
    for (int k = i + 1; k < j; ++k) std::swap(L_(k, i), L_(j, k));
    for (int k = j + 1; k < n; ++k) std::swap(L_(k, i), L_(k, j));
    std::swap(L_(i, i), L_(j, j));
  }

  SquareMatrix<n> L_ = SquareMatrix<n>::Identity();  // below the diagonal
  ColumnVector<n> inverse_pivot_ = ColumnVector<n>::Ones();
  std::array<int, n> row_ = [] {
    std::array<int, n> same{};
    for (int i = 0; i < n; ++i) same[static_cast<std::size_t>(i)] = i;
    return same;
  }();
};

/// A^-1 B for a regular matrix A, by elimination with the largest entry of each column as pivot. A singular A
/// gives entries that are not finite.
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
