#include "sim/deformable/neo_hookean.h"

#include <random>

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "sim/base/types.h"

namespace duet {
namespace {

using Matrix = Matrix3<double>;

Matrix from(const Mat3& m) {
  Matrix result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) result[i][j] = m(i, j);
  return result;
}
Mat3 to(const Matrix& m) {
  Mat3 result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) result(i, j) = m[i][j];
  return result;
}

constexpr double mu = 0.7, lambda = 3.1;

// Deformations at rest, stretched, sheared, past the start of the extrapolation, flat and inside out.
std::vector<Mat3> deformations() {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-0.3, 0.3);
  std::vector<Mat3> result;
  for (double depth : {1.0, 0.5, 0.26, 0.2, 0.0, -0.5, -1.0})
    for (int i = 0; i < 4; ++i) {
      Mat3 F = Vec3(1.1, 0.95, depth).asDiagonal();
      for (int k = 0; k < 9; ++k) F(k / 3, k % 3) += (depth == 1.0 ? 1 : 0.3) * uniform(random);
      result.push_back(F);
    }
  return result;
}

TEST(NeoHookean, StressIsTheGradientOfTheEnergyInsideOutAsWell) {
  for (const Mat3& F : deformations()) {
    const Mat3 P = to(neo_hookean::stress(mu, lambda, from(F)));
    constexpr double h = 1e-6;
    for (int k = 0; k < 9; ++k) {
      Mat3 up = F, down = F;
      up(k / 3, k % 3) += h;
      down(k / 3, k % 3) -= h;
      const double slope = (neo_hookean::energy_density(mu, lambda, from(up)) -
                            neo_hookean::energy_density(mu, lambda, from(down))) /
                           (2 * h);
      EXPECT_NEAR(P(k / 3, k % 3), slope, 1e-6 * std::max(1.0, P.norm()));
    }
  }
}

TEST(NeoHookean, RestHasNoStressAndTheLinearStiffnessOfItsLameParameters) {
  EXPECT_LT(to(neo_hookean::stress(mu, lambda, from(Mat3::Identity()))).norm(), 1e-15);
  const Mat3 strain = (Mat3() << 1, 0.2, 0, 0.2, -0.4, 0.1, 0, 0.1, 0.3).finished();
  constexpr double h = 1e-7;
  const Mat3 P = to(neo_hookean::stress(mu, lambda, from(Mat3::Identity() + h * strain))) / h;
  EXPECT_LT((P - (2 * mu * strain + lambda * strain.trace() * Mat3::Identity())).norm(), 1e-5);  // O(h)
}

TEST(NeoHookean, StressTurnsWithTheBodyAndHasNoMoment) {
  const Mat3 R = Quat(0.3, 0.5, -0.7, 0.4).normalized().toRotationMatrix();
  for (const Mat3& F : deformations()) {
    const Mat3 P = to(neo_hookean::stress(mu, lambda, from(F)));
    EXPECT_LT((to(neo_hookean::stress(mu, lambda, from(R * F))) - R * P).norm(), 1e-12 * (1 + P.norm()));
    EXPECT_LT((to(neo_hookean::stress(mu, lambda, from(F * R))) - P * R).norm(), 1e-12 * (1 + P.norm()));
    const Mat3 kirchhoff = P * F.transpose();
    EXPECT_LT((kirchhoff - kirchhoff.transpose()).norm(), 1e-12 * (1 + kirchhoff.norm()));
  }
}

TEST(NeoHookean, FlatAndInvertedElementsArePushedBack) {
  for (double depth : {0.2, 0.05, 0.0, -0.3, -1.0}) {
    const Mat3 F = Vec3(1, 1, depth).asDiagonal();
    // Work done by the stress for an increase of the depth is negative: the element wants to open.
    EXPECT_LT(to(neo_hookean::stress(mu, lambda, from(F)))(2, 2), 0) << depth;
  }
}

TEST(NeoHookean, ViscousStressIsLinearSymmetricDissipativeAndHasNoMoment) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto rate = [&] {
    Mat3 m;
    for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = uniform(random);
    return m;
  };
  const auto stress = [](const Mat3& F, const Mat3& Fdot) {
    return to(neo_hookean::viscous_stress(mu, lambda, 0.01, from(F), from(Fdot)));
  };
  for (const Mat3& F : deformations()) {
    const Mat3 A = rate(), B = rate();
    const Mat3 PA = stress(F, A), PB = stress(F, B);
    EXPECT_LT((stress(F, A + 2 * B) - PA - 2 * PB).norm(), 1e-14);
    EXPECT_NEAR(PA.cwiseProduct(B).sum(), PB.cwiseProduct(A).sum(), 1e-15);
    EXPECT_GE(PA.cwiseProduct(A).sum(), 0);
    const Mat3 kirchhoff = PA * F.transpose();
    EXPECT_LT((kirchhoff - kirchhoff.transpose()).norm(), 1e-15);
    const Mat3 spin = skew(Vec3(1, 2, 3)) * F;  // a rotation of the whole body is not damped
    EXPECT_LT(stress(F, spin).norm(), 1e-15);
  }
}

TEST(NeoHookean, SpectralNormBoundHoldsAndIsTightAtRest) {
  EXPECT_DOUBLE_EQ(neo_hookean::squared_spectral_norm(from(Mat3::Identity())), 1);
  for (const Mat3& F : deformations()) {
    const double exact = Eigen::SelfAdjointEigenSolver<Mat3>(F.transpose() * F).eigenvalues()[2];
    EXPECT_GE(neo_hookean::squared_spectral_norm(from(F)), exact - 1e-12);
  }
  EXPECT_DOUBLE_EQ(neo_hookean::stiffening(mu, lambda, from(Mat3::Identity())), 1);
}

TEST(NeoHookean, PacksGiveTheSameBitsAsScalars) {
  const std::vector<Mat3> all = deformations();
  for (std::size_t start = 0; start + pack_width <= all.size(); start += pack_width) {
    Matrix3<Pack> F;
    for (std::size_t lane = 0; lane < pack_width; ++lane)
      for (int k = 0; k < 9; ++k) F[k / 3][k % 3][lane] = all[start + lane](k / 3, k % 3);
    const Pack m = Pack{} + mu, l = Pack{} + lambda;
    const Matrix3<Pack> P = neo_hookean::stress(m, l, F);
    for (std::size_t lane = 0; lane < pack_width; ++lane) {
      const Matrix scalar = neo_hookean::stress(mu, lambda, from(all[start + lane]));
      for (int k = 0; k < 9; ++k) EXPECT_EQ(P[k / 3][k % 3][lane], scalar[k / 3][k % 3]);
    }
  }
}

}  // namespace
}  // namespace duet
