#include "sim/deformable/materials/viscous_stress.h"

#include "tests/support/deformations.h"
#include <gtest/gtest.h>

namespace duet::viscous_stress_test {
namespace {

Mat3 stress(const Mat3& F, const Mat3& Fdot) {
  return test::eigen_of(viscous_stress(0.7, 3.1, 0.01, test::matrix_of(F), test::matrix_of(Fdot)));
}

// The viscous stress is linear in the velocity gradient, symmetric as an operator and dissipative; P F^T is
// symmetric, so there is no moment. The bounds are rounding, as a multiple of 1 + |F|^2.
TEST(ViscousStress, IsLinearSymmetricDissipativeAndHasNoMoment) {
  std::mt19937 random(11);
  for (const Mat3& F : test::deformations()) {
    const Mat3 A = test::random_matrix(random), B = test::random_matrix(random);
    const Mat3 PA = stress(F, A), PB = stress(F, B);
    const double scale = 1 + F.squaredNorm();
    EXPECT_LT((stress(F, A + 2 * B) - PA - 2 * PB).norm(), 1e-15 * scale);
    EXPECT_NEAR(PA.cwiseProduct(B).sum(), PB.cwiseProduct(A).sum(), 1e-15 * scale);
    EXPECT_GE(PA.cwiseProduct(A).sum(), 0);
    const Mat3 kirchhoff = PA * F.transpose();
    EXPECT_LT((kirchhoff - kirchhoff.transpose()).norm(), 1e-15 * scale);
    const Mat3 spin = skew(Vec3(1, 2, 3)) * F;  // the rotation of a whole body is not damped
    EXPECT_LT(stress(F, spin).norm(), 1e-15 * scale);
  }
}

// The excess damping is the mean square stretch, between 1 and 16. In a rod that is stretched to twice its
// length, a viscous stress from the Green strain alone would brake four times as strongly as at rest.
TEST(ViscousStress, ExcessIsTheMeanSquareStretchFromOneToSixteen) {
  const auto excess = [](double a, double b, double c) {
    return excess_damping(test::matrix_of(Vec3(a, b, c).asDiagonal().toDenseMatrix()));
  };
  EXPECT_EQ(excess(1, 1, 1), 1);
  EXPECT_DOUBLE_EQ(excess(1.5, 1.5, 1.5), 2.25);
  EXPECT_DOUBLE_EQ(excess(3, 0.5, -0.5), 9.5 / 3);
  EXPECT_EQ(excess(0.1, 0.1, 0.1), 1);
  EXPECT_EQ(excess(100, 1, 1), 16);
}

}  // namespace
}  // namespace duet::viscous_stress_test
