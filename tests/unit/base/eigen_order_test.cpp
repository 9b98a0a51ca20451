// Scalar products are summed up in the same order with every version of Eigen.
#include <gtest/gtest.h>

#include "sim/base/types.h"

namespace duet::eigen_order_test {
namespace {

constexpr double tiny = 0x1p-53;  // half of the last place of 1

TEST(EigenOrder, ScalarProductsEndWithTheirFirstTerm) {
  // 1 + (tiny + tiny) is the next number after 1, (1 + tiny) + tiny is 1.
  const Vec3 a(1, tiny, tiny), ones(1, 1, 1);
  EXPECT_EQ(a.dot(ones), 1 + 2 * tiny);
  EXPECT_EQ(ones.dot(a), 1 + 2 * tiny);
  EXPECT_EQ((a + Vec3::Zero()).dot(ones), 1 + 2 * tiny);
  EXPECT_EQ(a.transpose().dot(ones), 1 + 2 * tiny);
  EXPECT_EQ(a.sum(), 1 + 2 * tiny);
}

// Halves first: (a + (b + c)) + (d + (e + f)).
TEST(EigenOrder, SixTermsAreSummedUpInHalves) {
  Vec6 a;
  a << 1, tiny, tiny, 0, tiny, tiny;
  EXPECT_EQ(a.dot(Vec6::Ones()), (1 + 2 * tiny) + 2 * tiny);
  a << 1, tiny, 0, 0, tiny, 0;
  EXPECT_EQ(a.dot(Vec6::Ones()), 1);
}

}  // namespace
}  // namespace duet::eigen_order_test
