#include "sim/base/dense_solvers.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace duet::dense_solvers_test {
namespace {

// A sequence of random matrices from one seed.
class RandomMatrices {
 public:
  template <int n>
  SquareMatrix<n> next() {
    SquareMatrix<n> A;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) A(i, j) = entry_(engine_);
    return A;
  }
  template <int n>
  SquareMatrix<n> rotation() {  // Returns an orthogonal matrix by modified Gram-Schmidt, in two passes.
    SquareMatrix<n> A = next<n>();
    for (int j = 0; j < n; ++j) {
      for (int pass = 0; pass < 2; ++pass)
        for (int k = 0; k < j; ++k) A.col(j) -= A.col(k).dot(A.col(j)) * A.col(k);
      A.col(j).normalize();
    }
    return A;
  }

 private:
  std::mt19937_64 engine_{11};
  std::uniform_real_distribution<double> entry_{-1, 1};
};

// Expects the eigenvalues `expected` of A in ascending order, orthonormal eigenvectors, and A V = V D. The
// bounds are 1e-14, 45 times the machine epsilon, relative to the largest eigenvalue.
template <int n>
void expect_eigen(const SquareMatrix<n>& A, const ColumnVector<n>& expected) {
  const SymmetricEigen<n> eigen = symmetric_eigen<n>(A);
  const double size = expected.cwiseAbs().maxCoeff();
  EXPECT_LE((eigen.values - expected).cwiseAbs().maxCoeff(), 1e-14 * size);
  EXPECT_LE((eigen.vectors.transpose() * eigen.vectors - SquareMatrix<n>::Identity()).norm(), 1e-14);
  EXPECT_LE((A * eigen.vectors - eigen.vectors * eigen.values.asDiagonal()).norm(), 1e-14 * size);
}

// Matrices Q D Q^T give back their eigenvalues, also where these repeat, vanish, lie 1e-12 apart or span 16
// orders of magnitude.
TEST(SymmetricEigen, FindsTheEigenvaluesThatAMatrixWasMadeOf) {
  RandomMatrices random;
  for (const Vec3& values : {Vec3(1, 2, 3), Vec3(-5, 1e-8, 1e8), Vec3(2, 2, 2), Vec3(0, 0, 1),
                             Vec3(-1, -1, 4), Vec3(0, 0, 0), Vec3(1, 1 + 1e-12, 1 + 2e-12)})
    for (int i = 0; i < 50; ++i) {
      const Mat3 Q = random.rotation<3>();
      const Mat3 A = Q * values.asDiagonal() * Q.transpose();
      expect_eigen<3>((A + A.transpose()) / 2, values);
    }
  Vec6 six;
  six << -2, 0, 1e-3, 1, 1, 50;
  for (int i = 0; i < 50; ++i) {
    const Mat6 Q = random.rotation<6>();
    const Mat6 A = Q * six.asDiagonal() * Q.transpose();
    expect_eigen<6>((A + A.transpose()) / 2, six);
  }
}

// A diagonal matrix with ascending entries is left as it is, to the bit: no rotation, no change of signs.
TEST(SymmetricEigen, ADiagonalMatrixKeepsItsAxes) {
  const SymmetricEigen<3> eigen = symmetric_eigen<3>(Vec3(1, 2, 5).asDiagonal());
  EXPECT_EQ(eigen.values, Vec3(1, 2, 5));
  EXPECT_EQ(eigen.vectors, Mat3::Identity());
}

// Matrices with lengths of 1e-4 to 1e3 m in their lower half are solved as precisely as with 1 m: the error
// is measured with each component over its own scale. For the inverse the bound grows with the ratio of the
// scales, by which the products A^-1 A are larger than their sum. A pivot that is compared with an absolute
// number would fail at one of the sizes.
TEST(SymmetricFactor, SolvesWhatHasTheScalesOfMassesAndInertias) {
  RandomMatrices random;
  for (const double length : {1e-4, 1.0, 1e3})
    for (int i = 0; i < 50; ++i) {
      const Mat6 root = random.next<6>();
      Vec6 scale;
      scale << 1, 1, 1, length, length, length;
      const Mat6 A =
          scale.asDiagonal() * Mat6(root * root.transpose() + 0.1 * Mat6::Identity()) * scale.asDiagonal();
      const Vec6 x = scale.cwiseInverse().cwiseProduct(random.next<6>().col(0));
      const SymmetricFactor<6> factor(A);
      EXPECT_LE((factor.solve(A * x) - x).cwiseProduct(scale).norm(), 1e-12);
      EXPECT_LE((factor.inverse() * A - Mat6::Identity()).cwiseAbs().maxCoeff(),
                1e-9 / std::min(length, 1 / length));
    }
}

// For a matrix of rank 1 to 5, a right side in its range is still solved: directions without a pivot are left
// out, and rounding does not enter the solution as a large number.
TEST(SymmetricFactor, LeavesOutTheDirectionsOfASingularMatrix) {
  RandomMatrices random;
  for (int rank = 1; rank < 6; ++rank)
    for (int i = 0; i < 20; ++i) {
      Mat6 root = random.next<6>();
      root.rightCols(6 - rank).setZero();
      const Mat6 A = root * root.transpose();
      const Vec6 b = A * random.next<6>().col(0);
      EXPECT_LE((A * SymmetricFactor<6>(A).solve(b) - b).norm(), 1e-10 * (1 + b.norm())) << rank;
    }
}

// Well-conditioned matrices A with random right sides A X give back X. The bound of 1e-11 is rounding times
// the condition number, with a margin.
TEST(SolveGeneral, GivesWhatWasMultiplied) {
  RandomMatrices random;
  for (int i = 0; i < 200; ++i) {
    const Mat6 A = random.next<6>() + 3 * random.rotation<6>(), X = random.next<6>();
    EXPECT_LE((solve_general<6>(A, A * X) - X).norm(), 1e-11);
  }
  Mat6 exchange = Mat6::Zero();  // every diagonal entry is zero: fails without pivoting
  for (int i = 0; i < 6; ++i) exchange(i, 5 - i) = 1 + i;
  EXPECT_LE((solve_general<6>(exchange, Mat6::Identity()) * exchange - Mat6::Identity()).norm(), 1e-15);
}

}  // namespace
}  // namespace duet::dense_solvers_test
