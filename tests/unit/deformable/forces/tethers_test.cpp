#include "sim/deformable/forces/tethers.h"

#include <gtest/gtest.h>

namespace duet::tethers_test {
namespace {

TEST(Tethers, ForcesAreTheGradientOfTheEnergyAndOpposite) {
  Tethers tethers;
  tethers.add({0, 2, 30, 4});
  tethers.add({3, 1, 5, 0});
  std::vector<Vec3> x = {Vec3(1, 2, 3), Vec3(0, 1, 0), Vec3(1.1, 1.8, 3.3), Vec3(-1, 0.5, 2)};
  std::vector<Vec3> force(4, Vec3::Zero());
  tethers.add_elastic_forces(x, force);
  EXPECT_LT((force[0] + force[2]).norm() + (force[1] + force[3]).norm(), 1e-14);
  constexpr double h = 1e-6;
  for (std::size_t p = 0; p < 4; ++p)
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      std::vector<Vec3> above = x, below = x;
      above[p][axis] += h;
      below[p][axis] -= h;
      const double slope = (tethers.energy(above) - tethers.energy(below)) / (2 * h);
      EXPECT_NEAR(force[p][axis], -slope, 1e-8);  // quadratic: rounding alone
    }
}

TEST(Tethers, DampingOpposesTheRelativeVelocity) {
  Tethers tethers;
  tethers.add({0, 1, 30, 4});
  std::vector<Vec3> force(2, Vec3::Zero());
  tethers.add_damping_forces({Vec3(1, 0, 2), Vec3(0, 0, 2)}, force);
  EXPECT_EQ(force[0], Vec3(-4, 0, 0));
  EXPECT_EQ(force[1], Vec3(4, 0, 0));
}

// Two free particles of masses m and M on a spring: k (1/m + 1/M).
TEST(Tethers, FrequencyIsExactForOnePair) {
  Tethers tethers;
  tethers.add({0, 1, 30, 4});
  std::vector<double> rate(2, 0);
  tethers.add_stiffness(rate);
  rate[0] /= 2;
  rate[1] /= 5;
  EXPECT_DOUBLE_EQ(tethers.max_squared_frequency(rate), 30 * (0.5 + 0.2));
}

}  // namespace
}  // namespace duet::tethers_test
