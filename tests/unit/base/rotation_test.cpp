#include "sim/base/rotation.h"

#include <gtest/gtest.h>

namespace duet::rotation_test {
namespace {

// Rounding of a dozen operations on numbers around 1.
constexpr double rounding = 4e-15;

// The rotation maps one direction to the other and leaves the normal of both where it is: a rotation about
// any other axis would be longer.
TEST(ShortestTurn, TakesOneDirectionToTheOtherAboutTheNormalOfBoth) {
  const Vec3 from(1, 2, -0.5), to(-0.3, 0.4, 2);
  const Quat turn = shortest_rotation(from, to);
  EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), rounding);
  const Vec3 axis = from.cross(to).normalized();
  EXPECT_LT((turn * axis - axis).norm(), rounding);
  EXPECT_LT((shortest_rotation(from, 3 * from).coeffs() - Quat::Identity().coeffs()).norm(), rounding);
}

// For opposite directions any axis across them is right, and the result is still a unit quaternion.
TEST(ShortestTurn, OfOppositeDirectionsIsHalfATurnAcross) {
  for (const Vec3& from : {Vec3(1, 0, 0), Vec3(0, 0, -2), Vec3(1, -2, 0.5)}) {
    const Quat turn = shortest_rotation(from, -from);
    // Directions that are so near to opposite count as opposite.
    EXPECT_LT((turn * from + from).norm(), 1e-7 * from.norm());
    EXPECT_NEAR(turn.norm(), 1, rounding);
  }
}

// Rounding keeps a direction a unit one. Values that are not finite pass, because stages report them as
// errors.
TEST(Rotation, UnitDirectionsAreKnownToRounding) {
  EXPECT_TRUE(is_unit(Vec3(0.6, 0.8, 1e-9)));
  EXPECT_TRUE(is_unit(Vec3f(0.6F, 0, 0.8F)));
  EXPECT_TRUE(is_unit(Quat(0.5, -0.5, 0.5, 0.5)));
  EXPECT_FALSE(is_unit(Vec3(0.6, 0.8, 1e-2)));
  EXPECT_FALSE(is_unit(Quat(1, 0, 0, 0.01)));
  EXPECT_FALSE(is_unit(Vec3(Vec3::Zero())));
  EXPECT_TRUE(is_unit(Vec3(std::nan(""), 0, 0)));
}

#ifdef DUET_ASSERTS
// The logarithm of a quaternion that is not of unit length has no meaning.
TEST(Rotation, LogarithmRefusesOtherQuaternionsThanUnitOnes) {
  EXPECT_DEATH(logarithm(Quat(2, 0, 0, 0)), "is_unit");
}
#endif

}  // namespace
}  // namespace duet::rotation_test
