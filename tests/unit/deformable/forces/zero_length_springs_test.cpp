#include "sim/deformable/forces/zero_length_springs.h"

#include <gtest/gtest.h>

namespace duet::zero_length_springs_test {
namespace {

// Forces are -dE/dx by central differences, and opposite on the two particles of a spring.
TEST(ZeroLengthSprings, ForcesAreTheGradientOfTheEnergyAndOpposite) {
  ZeroLengthSprings zero_length_springs;
  zero_length_springs.add({0, 2, 30, 4});
  zero_length_springs.add({3, 1, 5, 0});
  std::vector<Vec3> x = {Vec3(1, 2, 3), Vec3(0, 1, 0), Vec3(1.1, 1.8, 3.3), Vec3(-1, 0.5, 2)};
  std::vector<Vec3> force(4, Vec3::Zero());
  zero_length_springs.add_elastic_forces(x, force);
  EXPECT_LT((force[0] + force[2]).norm() + (force[1] + force[3]).norm(), 1e-14);
  constexpr double h = 1e-6;
  for (std::size_t p = 0; p < 4; ++p)
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      std::vector<Vec3> above = x, below = x;
      above[p][axis] += h;
      below[p][axis] -= h;
      const double slope = (zero_length_springs.energy(above) - zero_length_springs.energy(below)) / (2 * h);
      EXPECT_NEAR(force[p][axis], -slope, 1e-8);  // the energy is quadratic: rounding alone
    }
}

// Damping forces are the coefficient times the relative velocity, and opposite on both particles.
TEST(ZeroLengthSprings, DampingOpposesTheRelativeVelocity) {
  ZeroLengthSprings zero_length_springs;
  zero_length_springs.add({0, 1, 30, 4});
  std::vector<Vec3> force(2, Vec3::Zero());
  zero_length_springs.add_damping_forces({Vec3(1, 0, 2), Vec3(0, 0, 2)}, force);
  EXPECT_EQ(force[0], Vec3(-4, 0, 0));
  EXPECT_EQ(force[1], Vec3(4, 0, 0));
}

// Two free particles with the masses m and M on a spring of stiffness k have omega^2 = k (1/m + 1/M).
TEST(ZeroLengthSprings, FrequencyIsExactForOnePair) {
  ZeroLengthSprings zero_length_springs;
  zero_length_springs.add({0, 1, 30, 4});
  std::vector<double> rate(2, 0);
  zero_length_springs.add_stiffness(rate);
  rate[0] /= 2;
  rate[1] /= 5;
  EXPECT_DOUBLE_EQ(zero_length_springs.max_omega_squared(rate), 30 * (0.5 + 0.2));
}

}  // namespace
}  // namespace duet::zero_length_springs_test
