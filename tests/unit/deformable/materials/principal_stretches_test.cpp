#include "sim/deformable/materials/principal_stretches.h"

#include "tests/support/deformations.h"
#include "tests/support/eigenvalues.h"
#include <Eigen/SVD>
#include <gtest/gtest.h>

namespace duet::principal_stretches_test {
namespace {

using test::eigen_of;
using test::matrix_of;

// Expects that F = U diag(s) V^T with rotations U and V, the singular values of Eigen, and a negative last
// stretch for a reflection. The bounds are rounding relative to |F|.
void expect_decomposed(const Mat3& F) {
  const PrincipalStretches<double> p = principal_stretches(matrix_of(F));
  const Mat3 U = eigen_of(p.U), V = eigen_of(p.V);
  const Vec3 s(p.stretch[0], p.stretch[1], p.stretch[2]);
  EXPECT_LT((U.transpose() * U - Mat3::Identity()).norm(), 1e-14) << F;
  EXPECT_LT((V.transpose() * V - Mat3::Identity()).norm(), 1e-14) << F;
  EXPECT_GT(U.determinant(), 0) << F;
  EXPECT_GT(V.determinant(), 0) << F;
  EXPECT_LE((U * s.asDiagonal() * V.transpose() - F).norm(), 1e-13 * F.norm()) << F;
  const Vec3 singular = Eigen::JacobiSVD<Mat3>(F).singularValues();
  EXPECT_NEAR(s[0], singular[0], 1e-13 * F.norm());
  EXPECT_NEAR(s[1], singular[1], 1e-13 * F.norm());
  EXPECT_NEAR(std::abs(s[2]), singular[2], 1e-13 * F.norm());
  if (std::abs(F.determinant()) > 1e-12) {
    EXPECT_EQ(s[2] < 0, F.determinant() < 0) << F;
  }
}

// The decomposition holds for mild, strong, flat and inverted deformations, and for random ones of two
// magnitudes.
TEST(PrincipalStretches, DecomposeAnyDeformation) {
  for (const Mat3& F : test::deformations()) expect_decomposed(F);
  std::mt19937 random(5);
  for (int i = 0; i < 1000; ++i) expect_decomposed(test::random_matrix(random, i % 2 ? 1 : 1e4));
}

// Equal and zero stretches leave the rotations undetermined; the decomposition must hold nevertheless.
TEST(PrincipalStretches, AlikeFlatAndVanishingOnesAreNoException) {
  const Mat3 R = Quat(0.3, 0.5, -0.7, 0.4).normalized().toRotationMatrix();
  expect_decomposed(Mat3::Identity());
  expect_decomposed(-Mat3::Identity());
  expect_decomposed(R);
  expect_decomposed(R * Vec3(2, 1, 1).asDiagonal());
  expect_decomposed(R * Vec3(1, 1, -1).asDiagonal() * R);
  expect_decomposed(R * Vec3(1, 1, 0).asDiagonal());
  expect_decomposed(R * Vec3(0, 3, 0).asDiagonal() * R);
  expect_decomposed(Mat3::Zero());
}

// The bound of the squared spectral norm holds for all deformations, and is exact for F = 1.
TEST(PrincipalStretches, SpectralNormBoundHoldsAndIsTightAtRest) {
  EXPECT_DOUBLE_EQ(squared_spectral_norm(matrix_of(Mat3::Identity())), 1);
  for (const Mat3& F : test::deformations()) {
    const double exact = test::eigenvalues(F.transpose() * F)[2];
    EXPECT_GE(squared_spectral_norm(matrix_of(F)), exact - 1e-12);
  }
}

}  // namespace
}  // namespace duet::principal_stretches_test
