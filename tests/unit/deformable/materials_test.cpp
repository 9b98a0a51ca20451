// Laws that every material model keeps: the stress is the gradient of an energy, turns with the body, has the
// stiffness of its moduli at rest and opens compressed elements; its differential is the exact projection of
// the energy's Hessian to positive semi-definite.
#include <algorithm>

#include "tests/support/deformations.h"
#include "tests/support/eigenvalues.h"
#include "tests/support/margin.h"
#include <gtest/gtest.h>

#include "sim/deformable/materials/corotated.h"
#include "sim/deformable/materials/neo_hookean.h"
#include "sim/deformable/materials/st_venant_kirchhoff.h"
#include "sim/deformable/materials/stress_differential.h"

namespace duet::materials_test {
namespace {

using test::deformations;
using test::eigen_of;
using test::eigenvalues;
using test::matrix_of;

constexpr double mu = 0.7, lambda = 3.1;

template <class Model>
class Material : public ::testing::Test {
 protected:
  static double energy(const Mat3& F) { return Model::energy_density(mu, lambda, matrix_of(F)); }
  static Mat3 stress(const Mat3& F) { return eigen_of(Model::stress(mu, lambda, matrix_of(F))); }
  static double omega_squared(const Mat3& F, const GradientScatter<double>& scatter) {
    return Model::omega_squared(mu, lambda, matrix_of(F), scatter);
  }
  static StressDifferential<double> differential(const Mat3& F) {
    const PrincipalStretches<double> p = principal_stretches(matrix_of(F));
    return stress_differential(p, Model::derivatives(mu, lambda, p.stretch));
  }
};
// A flat tetrahedron with four different masses: the gradients of its shape functions, and what they make of
// a Hessian.
struct Element {
  Mat3 inverse_rest = (Mat3() << 1, 0.2, 0.1, -0.3, 1.4, 0.2, 0.3, -0.5, 3).finished();
  std::array<double, 4> mass = {0.3, 0.4, 0.2, 0.5};

  Vec3 gradient(int i) const {
    return i == 0 ? Vec3(-inverse_rest.colwise().sum().transpose())
                  : Vec3(inverse_rest.row(i - 1).transpose());
  }
  // Returns the sum of g g^T / m over the nodes, with its largest eigenvalue.
  GradientScatter<double> scatter() const {
    Mat3 S = Mat3::Zero();
    for (int i = 0; i < 4; ++i)
      S += gradient(i) * gradient(i).transpose() / mass[static_cast<std::size_t>(i)];
    return {matrix_of(S), eigenvalues(S)[2]};
  }
  // Returns the largest eigenvalue of M^-1 K per volume, where `hessian` maps dF to dP, both row by row.
  double omega_squared(const Eigen::Matrix<double, 9, 9>& hessian) const {
    // Maps displacements, times the roots of the masses, to dF.
    Eigen::MatrixXd B = Eigen::MatrixXd::Zero(9, 12);
    for (int i = 0; i < 4; ++i)
      for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c)
          B(3 * r + c, 3 * i + r) = gradient(i)[c] / std::sqrt(mass[static_cast<std::size_t>(i)]);
    const Eigen::MatrixXd K = B.transpose() * hessian * B;
    return eigenvalues(0.5 * (K + K.transpose()))[11];
  }
};

using Models = ::testing::Types<NeoHookean, Corotated, StVenantKirchhoff>;
TYPED_TEST_SUITE(Material, Models);

using Mat9 = Eigen::Matrix<double, 9, 9>;

Mat3 unit_matrix(int k) {
  Mat3 m = Mat3::Zero();
  m(k / 3, k % 3) = 1;
  return m;
}

// Returns the central difference of fourth order. Truncation is h^4 times the fifth derivative, rounding
// 1e-16 / h.
template <class Function>
auto derivative(Function&& f, const Mat3& F, const Mat3& direction, double h) {
  using Value = decltype(f(F));
  const Value near = f(F + h * direction) - f(F - h * direction);
  const Value far = f(F + 2 * h * direction) - f(F - 2 * h * direction);
  return Value((8 * near - far) / (12 * h));
}

// P = dE/dF by central differences, also for inverted deformations and on both sides of the start of the
// extrapolation.
TYPED_TEST(Material, StressIsTheGradientOfTheEnergyInsideOutAsWell) {
  for (const Mat3& F : deformations()) {
    const Mat3 P = this->stress(F);
    for (int k = 0; k < 9; ++k) {
      const double slope =
          derivative([&](const Mat3& G) { return this->energy(G); }, F, unit_matrix(k), 1e-4);
      EXPECT_NEAR(P(k / 3, k % 3), slope, 1e-6 * std::max(1.0, P.norm())) << F;
    }
  }
}

// At rest the stress vanishes, and for small strains it is 2 mu e + lambda tr(e) 1 (Hooke's law). The omega^2
// bound and the differential at rest are those of linear elasticity.
TYPED_TEST(Material, AtRestHasNoStressAndTheStiffnessOfHooke) {
  EXPECT_LT(this->stress(Mat3::Identity()).norm(), 1e-15);
  EXPECT_EQ(this->energy(Mat3::Identity()), 0);
  const Element element;
  EXPECT_NEAR(this->omega_squared(Mat3::Identity(), element.scatter()), element.scatter().at_rest(mu, lambda),
              1e-12 * element.scatter().at_rest(mu, lambda));
  const Mat3 strain = (Mat3() << 1, 0.2, 0, 0.2, -0.4, 0.1, 0, 0.1, 0.3).finished();
  const Mat3 linear = 2 * mu * strain + lambda * strain.trace() * Mat3::Identity();
  constexpr double h = 1e-7;
  // The bound leaves room for terms of the order of h.
  EXPECT_LT((this->stress(Mat3::Identity() + h * strain) / h - linear).norm(), 1e-5);
  const Mat3 spin = skew(Vec3(1, 2, 3));
  const Mat3 dP = eigen_of(this->differential(Mat3::Identity()) * matrix_of(strain + spin));
  EXPECT_LT((dP - linear).norm(), 1e-14);  // rotation meets no resistance
}

// The law is objective, P(R F) = R P(F), and isotropic, P(F R) = P(F) R, and P F^T is symmetric.
TYPED_TEST(Material, StressTurnsWithTheBodyAndHasNoMoment) {
  const Mat3 R = Quat(0.3, 0.5, -0.7, 0.4).normalized().toRotationMatrix();
  for (const Mat3& F : deformations()) {
    const Mat3 P = this->stress(F);
    EXPECT_LT((this->stress(R * F) - R * P).norm(), 1e-12 * (1 + P.norm()));
    EXPECT_LT((this->stress(F * R) - P * R).norm(), 1e-12 * (1 + P.norm()));
    EXPECT_NEAR(this->energy(R * F), this->energy(F), 1e-12 * (1 + this->energy(F)));
    const Mat3 kirchhoff = P * F.transpose();
    EXPECT_LT((kirchhoff - kirchhoff.transpose()).norm(), 1e-12 * (1 + kirchhoff.norm()));
  }
}

// Elements that are compressed along one axis, flat or inverted are driven open.
TYPED_TEST(Material, FlatAndInvertedElementsArePushedBack) {
  for (const double depth : {0.2, 0.05, 0.0, -0.3, -0.9}) {
    const Mat3 F = Vec3(1, 1, depth).asDiagonal();
    // The stress does negative work for an increase of the depth: the element opens.
    EXPECT_LT(this->stress(F)(2, 2), 0) << depth;
  }
}

// The differential is the energy's Hessian, found from differences of the stress, with its negative
// eigenvalues set to zero. The bounds of 1e-6 are those of the differences.
TYPED_TEST(Material, DifferentialIsTheProjectedHessian) {
  for (const Mat3& F : deformations()) {
    Mat9 hessian, projected;
    const StressDifferential<double> H = this->differential(F);
    for (int k = 0; k < 9; ++k) {
      const Mat3 dP = derivative([&](const Mat3& G) { return this->stress(G); }, F, unit_matrix(k), 1e-5);
      const Mat3 HdF = eigen_of(H * matrix_of(unit_matrix(k)));
      hessian.col(k) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(Mat3(dP.transpose()).data());
      projected.col(k) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(Mat3(HdF.transpose()).data());
    }
    EXPECT_LT((hessian - hessian.transpose()).norm(), 1e-6 * hessian.norm()) << F;
    EXPECT_LT((projected - projected.transpose()).norm(), 1e-13 * projected.norm()) << F;
    const Mat9 expected = test::positive_part(0.5 * (hessian + hessian.transpose()));
    EXPECT_LT((projected - expected).norm(), 1e-6 * hessian.norm()) << F;
    EXPECT_GT(eigenvalues(projected)[0], -1e-13 * projected.norm());
  }
}

// The bound limits explicit steps: it must hold in every state, and its excess is wasted time.
TYPED_TEST(Material, FrequencyBoundHoldsInEveryState) {
  const Element element;
  std::vector<Mat3> states = deformations();
  for (const double s : {0.1, 0.2, 0.27, 0.5, 0.8, 1.2, 1.5, 3.0})
    for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(0, 1, 1), Vec3(1, 1, 1)})
      states.push_back((Vec3::Ones() + (s - 1) * axis).asDiagonal());
  double worst = 0;
  for (const Mat3& F : states) {
    Mat9 hessian;
    for (int k = 0; k < 9; ++k) {
      const Mat3 dP = derivative([&](const Mat3& G) { return this->stress(G); }, F, unit_matrix(k), 1e-5);
      hessian.col(k) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(Mat3(dP.transpose()).data());
    }
    const double exact = element.omega_squared(0.5 * (hessian + hessian.transpose())),
                 bound = this->omega_squared(F, element.scatter());
    EXPECT_LE(exact, bound * (1 + 1e-6)) << F;  // error of the differences
    worst = std::max(worst, bound / exact);
  }
  // Steps are shorter than necessary by the square root of the ratio: by a half in the worst state, or by two
  // thirds.
  test::expect_below(worst, std::is_same_v<TypeParam, NeoHookean> ? 4 : 9, "bound over exact");
}

// The stiffness that damps compressed elements is all of the stiffness that compression adds, except for its
// negative part, and rotations are not damped. The remaining stiffness has a bound of its own,
// `uncompressed_omega_squared`. Both hold in all states that explicit steps have to survive.
TEST(CompressionStiffness, IsAllThatCompressionAdds) {
  const Element element;
  std::vector<Mat3> states = deformations();
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  for (const double s : {-0.1, 0.05, 0.2, 0.3, 0.5, 0.8, 1.2, 1.5})
    for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 1, 1), Vec3(1, 1, 1)})
      states.push_back(turn * Mat3((Vec3::Ones() + (s - 1) * axis).asDiagonal()));
  for (const Mat3& F : states) {
    const double J = F.determinant();
    const CompressionStiffness<double> C = NeoHookean::compression_stiffness(mu, lambda, matrix_of(F));
    Mat9 added, damped;  // rows hold dP row by row; mu |dF|^2 of the rest is left out
    for (int k = 0; k < 9; ++k) {
      const auto stress = [](const Mat3& G) {
        return eigen_of(NeoHookean::stress(mu, lambda, matrix_of(G)));
      };
      const Mat3 dP = derivative(stress, F, unit_matrix(k), 1e-5) - mu * unit_matrix(k);
      const Mat3 CdF = eigen_of(C * matrix_of(unit_matrix(k)));
      added.col(k) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(Mat3(dP.transpose()).data());
      damped.col(k) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(Mat3(CdF.transpose()).data());
    }
    for (const int k : {1, 2, 5}) {  // a spin is not damped
      const Mat3 spin = unit_matrix(k) - unit_matrix(k).transpose();
      EXPECT_LT(eigen_of(C * matrix_of(Mat3(spin * F))).norm(), 1e-13 * damped.norm()) << F;
    }
    EXPECT_LT((damped - damped.transpose()).norm(), 1e-13 * damped.norm()) << F;
    EXPECT_GT(eigenvalues(damped)[0], -1e-13 * damped.norm()) << F;
    const Mat9 left = 0.5 * (added + added.transpose()) - damped;
    if (J > 1.1 * NeoHookean::extrapolation_start && J < 1) {  // differences stay on one side of both limits
      EXPECT_LT(eigenvalues(left)[8], 1e-6 * damped.norm()) << F;
      for (const Mat3& pure : {Mat3(Mat3::Identity()), Mat3(Vec3(1, -2, 0.5).asDiagonal())}) {
        const Mat3 row_by_row = Mat3(pure * F).transpose();
        const auto dF = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(row_by_row.data());
        EXPECT_NEAR(dF.dot(left * dF), 0, 1e-6 * dF.dot(damped * dF)) << F;
      }
    }
    const double soft = NeoHookean::uncompressed_omega_squared(mu, lambda, matrix_of(F), element.scatter());
    EXPECT_LE(element.omega_squared(left + mu * Mat9::Identity()), soft * (1 + 1e-6)) << F;
  }
}

// For random deformations of any rank the differential is finite, symmetric and never negative, to rounding.
TYPED_TEST(Material, DifferentialIsPositiveSemiDefiniteForAnyDeformation) {
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    // F has rank 3, 2, 1 or 0.
    Mat3 F = test::random_matrix(random, 2);
    for (int k = 0; k < i % 4; ++k) F.col(k) = k == 2 ? Vec3::Zero() : Vec3(2 * F.col(2));
    const StressDifferential<double> H = this->differential(F);
    const Mat3 A = test::random_matrix(random), B = test::random_matrix(random);
    const Mat3 HA = eigen_of(H * matrix_of(A)), HB = eigen_of(H * matrix_of(B));
    const double work = HA.cwiseProduct(A).sum();
    ASSERT_TRUE(std::isfinite(work)) << F;
    EXPECT_GE(work, -1e-13 * HA.norm()) << F;
    EXPECT_NEAR(HA.cwiseProduct(B).sum(), HB.cwiseProduct(A).sum(), 1e-13 * (HA.norm() + HB.norm())) << F;
  }
}

// Stress and differential have the same bits in packs of eight as one by one.
TYPED_TEST(Material, PacksGiveTheSameBitsAsScalars) {
  const std::vector<Mat3> all = deformations();
  ASSERT_EQ(all.size() % pack_width, 0);
  for (std::size_t start = 0; start < all.size(); start += pack_width) {
    Matrix3<double8> F;
    for (std::size_t lane = 0; lane < pack_width; ++lane)
      for (int k = 0; k < 9; ++k) F[k / 3][k % 3][lane] = all[start + lane](k / 3, k % 3);
    const double8 m = double8{} + mu, l = double8{} + lambda;
    const Matrix3<double8> P = TypeParam::stress(m, l, F);
    const PrincipalStretches<double8> p = principal_stretches(F);
    const Matrix3<double8> HF = stress_differential(p, TypeParam::derivatives(m, l, p.stretch)) * F;
    for (std::size_t lane = 0; lane < pack_width; ++lane) {
      const Mat3 scalar = this->stress(all[start + lane]);
      const Mat3 differential =
          eigen_of(this->differential(all[start + lane]) * matrix_of(all[start + lane]));
      for (int k = 0; k < 9; ++k) {
        EXPECT_EQ(P[k / 3][k % 3][lane], scalar(k / 3, k % 3));
        EXPECT_EQ(HF[k / 3][k % 3][lane], differential(k / 3, k % 3));
      }
    }
  }
}

// Under compression along one axis, with the others held, the stress grows all the way. Plain St.
// Venant-Kirchhoff elements would give way from a stretch of 1 / sqrt(3) on and come to rest inside out.
// (Below -1 another axis is the shortest, and it is that one that opens.)
TEST(StVenantKirchhoff, ResistsCompressionMoreAndMore) {
  double last = 0;
  for (double s = 0.99; s > -0.995; s -= 0.01) {
    const Mat3 F = Vec3(1, 1, s).asDiagonal();
    const double stress = eigen_of(StVenantKirchhoff::stress(mu, 0.0, matrix_of(F)))(2, 2);
    EXPECT_LT(stress, last) << s;
    last = stress;
  }
}

}  // namespace
}  // namespace duet::materials_test
