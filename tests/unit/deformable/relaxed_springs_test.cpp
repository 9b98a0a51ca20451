// Stability of relaxed step limits for springs, as relaxed_steps_test.cpp shows it for finite elements.
// Springs with more than critical damping allow steps beyond the limit of their stiffness, which are stable
// as long as dt^2 K - 2 dt D <= 4 M.
#include <algorithm>
#include <random>
#include <set>

#include "tests/support/eigenvalues.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <gtest/gtest.h>

#include "sim/deformable/forces/internal_forces.h"

namespace duet::relaxed_springs_test {
namespace {

constexpr double cfl = 0.7, relaxation = 0.25;

// A lattice with springs along all edges and along the shortest altitudes, as in the scene `pile`. `damping`
// is relative to critical damping.
struct Block {
  InternalForces forces;
  std::vector<Vec3> x;
  std::vector<double> mass;

  Block(const Vec3& size, double damping) {
    const double modulus = 4e4;
    const TetMesh mesh = box_lattice(size, Vec3i(3, 3, 3));
    x = mesh.nodes;
    mass.assign(x.size(), 0);
    std::set<std::pair<int, int>> edges;
    for (const Tet& tet : mesh.tets)
      for (std::size_t i = 0; i < 4; ++i) {
        mass[as_index(tet[i])] += 300 * size.prod() / static_cast<double>(4 * mesh.tets.size());
        for (std::size_t j = 0; j < i; ++j) edges.insert(std::minmax(tet[i], tet[j]));
      }
    std::vector<double> inverse;
    for (const double m : mass) inverse.push_back(1 / m);
    for (const auto& [a, b] : edges) {
      const double length = (x[as_index(a)] - x[as_index(b)]).norm(), k = modulus / length;
      forces.edge_springs.add(
          {{a, b},
           {1, -1},
           length,
           k,
           critical_viscosity<2>(damping, k, {1, -1}, {inverse[as_index(a)], inverse[as_index(b)]})});
    }
    forces.altitude_springs.add(mesh.tets, x, modulus, damping);
    forces.finalize(mass, inverse, mass);
    forces.rely_on_damping(cfl, relaxation);
  }

  template <class Forces>  // `of` takes displacements or velocities and adds forces (N) to its second
                           // argument
  Eigen::MatrixXd matrix(Forces&& of) const {
    const auto n = static_cast<Eigen::Index>(3 * x.size());
    Eigen::MatrixXd A(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      std::vector<Vec3> unit(x.size(), Vec3::Zero()), force = unit;
      unit[as_index(j / 3)][j % 3] = 1;
      of(unit, force);
      for (Eigen::Index i = 0; i < n; ++i)
        A(i, j) = -force[as_index(i / 3)][i % 3] / std::sqrt(mass[as_index(i / 3)] * mass[as_index(j / 3)]);
    }
    return 0.5 * (A + A.transpose());
  }

  // Returns the largest eigenvalue of M^-1 (dt^2 K - 2 dt D) with the time step that the rule chooses in this
  // state. Above 4 the step is unstable.
  double growth() {
    forces.choose_altitudes(x);
    std::vector<Vec3> force(x.size(), Vec3::Zero());
    forces.add_elastic_forces(x, force);
    const double dt = 2 * cfl / std::sqrt(forces.max_omega_squared());
    const Eigen::MatrixXd D = matrix(
        [&](const std::vector<Vec3>& v, std::vector<Vec3>& out) { forces.add_damping_forces(v, out); });
    const Eigen::MatrixXd K = matrix([&](const std::vector<Vec3>& dx, std::vector<Vec3>& out) {
      constexpr double h = 1e-6;
      std::vector<Vec3> up = x, down = x, opposite = out;
      for (std::size_t p = 0; p < x.size(); ++p) {
        up[p] += h * dx[p];
        down[p] -= h * dx[p];
      }
      forces.add_elastic_forces(up, out);
      forces.add_elastic_forces(down, opposite);
      for (std::size_t p = 0; p < x.size(); ++p) out[p] = (out[p] - opposite[p]) / (2 * h);
    });
    return test::eigenvalues(dt * dt * K - 2 * dt * D).maxCoeff();
  }
};

// In flat, long, stretched, compressed and inverted states the largest eigenvalue stays below 4 cfl^2, that
// of an undamped oscillator at the chosen fraction of the limit, with 0.1 % for the differences. Steps reach
// more than ten times the elastic limit, so the damping does matter.
TEST(RelaxedSprings, AreStableInHardStates) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  double worst = 0, longest = 0;
  test::Cases cases(7);  // 39 of 270
  for (const double damping : {1.0, 3.0, 30.0})
    for (const Vec3& size : {Vec3(1, 1, 1), Vec3(1, 1, 0.15), Vec3(1, 0.2, 0.2)})
      for (const Vec3& stretch :
           {Vec3(1, 1, 1), Vec3(0.5, 1, 1), Vec3(1, 1, 0.4), Vec3(0.4, 1.4, 1.4), Vec3(1.4, 1.4, 0.4),
            Vec3(2, 0.8, 0.8), Vec3(3, 0.5, 1), Vec3(3, 3, 1), Vec3(1, 1, 0.05), Vec3(1, 1, -0.5)})
        for (const double jitter : {0.0, 0.04, 0.1}) {
          if (!cases.takes()) continue;
          Block block(size, damping);
          const double elastic = block.forces.elastic_omega_squared();
          longest = std::max(longest, std::sqrt(elastic / block.forces.rest_omega_squared()));
          for (Vec3& place : block.x) {
            place = place.cwiseProduct(stretch);
            for (int k = 0; k < 3; ++k) place[k] += jitter * size[k] * std::abs(stretch[k]) * uniform(random);
          }
          const double growth = block.growth();
          EXPECT_LT(growth, 4) << "damping " << damping << ", size " << size.transpose() << ", stretch "
                               << stretch.transpose() << ", jitter " << jitter;
          worst = std::max(worst, growth);
        }
  EXPECT_GT(longest, 10);  // ratio to the elastic limit
  test::expect_below(worst, 4 * cfl * cfl * 1.001, "largest eigenvalue");
}

// A spring with f times the critical damping has a damping time of tau = 2 f sqrt(m / k) seconds, where 1/m =
// 1/m_1 + 1/m_2, and its limit is `relaxation` times tau. A spring with little damping keeps its elastic
// limit, which then bounds the step.
TEST(RelaxedSprings, LimitsAreThoseOfTheirDampingTime) {
  const double k = 100, damping = 20;
  const std::vector<double> mass = {2, 3, 1, 1}, inverse = {1.0 / 2, 1.0 / 3, 1, 1};
  const auto limit = [&](double second, double relaxed) {
    InternalForces forces;
    forces.edge_springs.add(
        {{0, 1}, {1, -1}, 1, k, critical_viscosity<2>(damping, k, {1, -1}, {inverse[0], inverse[1]})});
    forces.edge_springs.add({{2, 3}, {1, -1}, 1, k, critical_viscosity<2>(second, k, {1, -1}, {1, 1})});
    forces.finalize(mass, inverse, mass);
    forces.rely_on_damping(cfl, relaxed);
    EXPECT_DOUBLE_EQ(forces.elastic_omega_squared(), 2 * k);
    return 2 / std::sqrt(forces.rest_omega_squared());
  };
  EXPECT_DOUBLE_EQ(limit(0, 0), std::sqrt(2 / k));
  EXPECT_DOUBLE_EQ(limit(0, 0.25), std::sqrt(2 / k));
  EXPECT_DOUBLE_EQ(limit(1, 0.25), std::sqrt(2 / k));
  EXPECT_DOUBLE_EQ(limit(100, 0.25), 0.25 * 2 * damping * std::sqrt(6.0 / 5 / k));
  EXPECT_DOUBLE_EQ(limit(100, 0.2), 0.2 * 2 * damping * std::sqrt(6.0 / 5 / k));
}

// A stretched spring of length |d| with the rest length L resists sideways displacements by k (1 - L / |d|).
// Damping does not hold this geometric stiffness, so it bounds the step.
TEST(RelaxedSprings, StretchingBoundsTheStep) {
  const double k = 100, stretched = 1.5;
  InternalForces forces;
  forces.edge_springs.add({{0, 1}, {1, -1}, 1, k, critical_viscosity<2>(100, k, {1, -1}, {1, 1})});
  forces.finalize({1, 1}, {1, 1}, {1, 1});
  forces.rely_on_damping(cfl, relaxation);
  std::vector<Vec3> force(2, Vec3::Zero());
  forces.add_elastic_forces({Vec3::Zero(), Vec3(0, stretched, 0)}, force);
  EXPECT_DOUBLE_EQ(forces.max_omega_squared(), 2 * k * (1 - 1 / stretched));
  forces.add_elastic_forces({Vec3::Zero(), Vec3(0, 0.5, 0)}, force);
  EXPECT_DOUBLE_EQ(forces.max_omega_squared(), forces.rest_omega_squared());
}

}  // namespace
}  // namespace duet::relaxed_springs_test
