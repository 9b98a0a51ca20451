// Stability of relaxed step limits: the scheme of steps I and V is stable as long as dt^2 K - 2 dt D <= 4 M,
// with the stiffness K, the damping D and the masses M. The tests compute the largest eigenvalue of M^-1
// (dt^2 K - 2 dt D) of blocks in hard states with dense matrices.
#include <algorithm>
#include <random>

#include "tests/support/eigenvalues.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <gtest/gtest.h>

#include "sim/deformable/forces/finite_elements.h"
#include "sim/deformable/materials/neo_hookean.h"

namespace duet::relaxed_steps_test {
namespace {

constexpr double tau = 0.01, cfl = 0.7, relaxation = 0.1;

// A block of 3 x 3 x 3 cells with finite elements of 1000 kg/m^3 and damping of tau.
struct Block {
  FiniteElements elements;
  std::vector<Vec3> x;
  std::vector<double> mass;

  Block(const Vec3& size, double youngs_modulus) {
    const TetMesh mesh = box_lattice(size, Vec3i(3, 3, 3));
    x = mesh.nodes;
    elements.add(mesh.tets, x, {lame_parameters(youngs_modulus, 0.45, tau)});
    mass.assign(x.size(), 0);
    for (std::size_t t = 0; t < mesh.tets.size(); ++t)
      for (int i : mesh.tets[t]) mass[static_cast<std::size_t>(i)] += 250 * elements.volume(t);
    elements.finalize(mass, mass, {});
    elements.rely_on_damping(cfl, relaxation);
  }

  template <class Forces>  // `forces` takes displacements or velocities and adds forces (N) to its second
                           // argument
  Eigen::MatrixXd matrix(Forces&& forces) const {
    const auto n = static_cast<Eigen::Index>(3 * x.size());
    Eigen::MatrixXd A(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      std::vector<Vec3> unit(x.size(), Vec3::Zero()), force = unit;
      unit[static_cast<std::size_t>(j / 3)][j % 3] = 1;
      forces(unit, force);
      for (Eigen::Index i = 0; i < n; ++i)
        A(i, j) = -force[static_cast<std::size_t>(i / 3)][i % 3] /
                  std::sqrt(mass[static_cast<std::size_t>(i / 3)] * mass[static_cast<std::size_t>(j / 3)]);
    }
    return 0.5 * (A + A.transpose());
  }

  // Returns the largest eigenvalue of M^-1 (dt^2 K - 2 dt D) with the time step that the rule chooses in this
  // state. Above 4 the step is unstable.
  double growth() {
    std::vector<Vec3> force(x.size(), Vec3::Zero());
    elements.add_elastic_forces(x, force);
    const double dt = 2 * cfl / std::sqrt(elements.max_omega_squared());
    elements.set_time_step(dt);
    elements.add_elastic_forces(x, force);
    const Eigen::MatrixXd D = matrix(
        [&](const std::vector<Vec3>& v, std::vector<Vec3>& out) { elements.add_damping_forces(v, out); });
    const Eigen::MatrixXd K = matrix([&](const std::vector<Vec3>& dx, std::vector<Vec3>& out) {
      constexpr double h = 1e-6;
      std::vector<Vec3> up = x, down = x, opposite = out;
      for (std::size_t p = 0; p < x.size(); ++p) {
        up[p] += h * dx[p];
        down[p] -= h * dx[p];
      }
      elements.add_elastic_forces(up, out);
      elements.add_elastic_forces(down, opposite);
      for (std::size_t p = 0; p < x.size(); ++p) out[p] = (out[p] - opposite[p]) / (2 * h);
    });
    return test::eigenvalues(dt * dt * K - 2 * dt * D).maxCoeff();
  }
};

// The viscosity V of one second, times the factor q that the rule computes, is at least the stiffness C of
// compression in all directions: C <= q V. Elements whose damping is too weak in one direction would impact
// up there.
TEST(RelaxedSteps, ViscosityHoldsTheStiffnessOfCompression) {
  using Mat9 = Eigen::Matrix<double, 9, 9>;
  const auto of = [](auto&& stress) {
    Mat9 A;
    for (int j = 0; j < 9; ++j) {
      Matrix3<double> unit{};
      unit[j / 3][j % 3] = 1;
      const Matrix3<double> P = stress(unit);
      for (int i = 0; i < 9; ++i) A(i, j) = P[i / 3][i % 3];
    }
    return Mat9(0.5 * (A + A.transpose()));
  };
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  double tightest = 1e9;
  for (const double poisson_ratio : {-0.4, 0.0, 0.3, 0.45}) {
    const LameParameters moduli = lame_parameters(1, poisson_ratio, 1);
    for (int i = 0; i < 3000; ++i) {
      Matrix3<double> F{};
      for (int k = 0; k < 9; ++k)
        F[k / 3][k % 3] = (k % 4 == 0 ? 1 : 0) + (i == 0 ? 0 : 0.6 * uniform(random));
      if (determinant(F, cofactor(F)) < NeoHookean::extrapolation_start) continue;
      const double q = NeoHookean::compression_over_viscosity(moduli.mu, moduli.lambda, F);
      const auto stiffness = NeoHookean::compression_stiffness(moduli.mu, moduli.lambda, F);
      const Mat9 C = of([&](const Matrix3<double>& dF) { return stiffness * dF; });
      const Mat9 V = of([&](const Matrix3<double>& dF) {
        return viscous_stress(moduli.mu, moduli.lambda, 1 / excess_damping(F), F, dF);
      });
      const auto largest = [](const Mat9& A) { return test::eigenvalues(A)[8]; };
      EXPECT_LT(largest(C - q * V), 1e-10 * largest(C)) << poisson_ratio << ", " << i;
      if (i == 0) tightest = std::min(tightest, q);
    }
  }
  EXPECT_LE(tightest, 2 * (1 + 1e-12));  // at rest, where q = 1 would be enough
}

// In all states the largest eigenvalue stays below 4 cfl^2, that of an undamped oscillator at the chosen
// fraction of the limit, with 0.1 % for the differences. Steps reach more than 3.5 times the elastic limit.
TEST(RelaxedSteps, AreStableInHardStates) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  double worst = 0, longest = 0;
  test::Cases cases(5);  // 29 of 144
  for (const Vec3& size :
       {Vec3(1, 1, 1), Vec3(1, 1, 0.15), Vec3(1, 0.2, 0.2)})  // also flat and long elements
    for (const Vec3& stretch : {Vec3(1, 1, 1), Vec3(0.5, 1, 1), Vec3(1, 1, 0.4), Vec3(0.4, 1.4, 1.4),
                                Vec3(1.4, 1.4, 0.4), Vec3(0.6, 0.6, 0.9), Vec3(2, 0.8, 0.8), Vec3(3, 0.5, 1)})
      for (const double jitter : {0.0, 0.04, 0.1})
        for (const double youngs_modulus : {1e7, 2e8}) {
          if (!cases.takes()) continue;
          Block block(size, youngs_modulus);
          const double elastic_limit = 2 / std::sqrt(block.elements.elastic_omega_squared());
          const double limit = 2 / std::sqrt(block.elements.rest_omega_squared());
          longest = std::max(longest, limit / elastic_limit);
          for (Vec3& place : block.x) {
            place = place.cwiseProduct(stretch);
            for (int k = 0; k < 3; ++k) place[k] += jitter * size[k] * stretch[k] * uniform(random);
          }
          const double growth = block.growth();
          EXPECT_LT(growth, 4) << "size " << size.transpose() << ", stretch " << stretch.transpose()
                               << ", jitter " << jitter << ", E " << youngs_modulus;
          worst = std::max(worst, growth);
        }
  EXPECT_GT(longest, 3.5);  // ratio to the elastic limit
  test::expect_below(worst, 4 * cfl * cfl * 1.001, "largest eigenvalue");
}

}  // namespace
}  // namespace duet::relaxed_steps_test
