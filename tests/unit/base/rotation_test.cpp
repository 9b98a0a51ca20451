#include "sim/base/rotation.h"

#include <gtest/gtest.h>

namespace duet::rotation_test {
namespace {

constexpr double rounding = 4e-15;  // of a dozen operations on numbers around 1

TEST(ShortestTurn, TakesOneDirectionToTheOtherAboutTheNormalOfBoth) {
  const Vec3 from(1, 2, -0.5), to(-0.3, 0.4, 2);
  const Quat turn = shortest_rotation(from, to);
  EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), rounding);
  const Vec3 axis = from.cross(to).normalized();
  EXPECT_LT((turn * axis - axis).norm(), rounding);
  EXPECT_LT((shortest_rotation(from, 3 * from).coeffs() - Quat::Identity().coeffs()).norm(), rounding);
}

TEST(ShortestTurn, OfOppositeDirectionsIsHalfATurnAcross) {
  for (const Vec3& from : {Vec3(1, 0, 0), Vec3(0, 0, -2), Vec3(1, -2, 0.5)}) {
    const Quat turn = shortest_rotation(from, -from);
    EXPECT_LT((turn * from + from).norm(), 1e-7 * from.norm());  // found by cosines near -1
    EXPECT_NEAR(turn.norm(), 1, rounding);
  }
}

}  // namespace
}  // namespace duet::rotation_test
