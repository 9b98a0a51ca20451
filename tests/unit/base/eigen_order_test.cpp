// Scalar products are summed in the same order with every version of Eigen, so that results have the same
// bits.
#include <gtest/gtest.h>

#include "sim/base/types.h"

namespace duet::eigen_order_test {
namespace {

constexpr double tiny = 0x1p-53;  // half the unit in the last place of 1

// A scalar product of three terms is a_1 b_1 + (a_2 b_2 + a_3 b_3) in every form in which the code writes it.
TEST(EigenOrder, ScalarProductsEndWithTheirFirstTerm) {
  // The sum 1 + (tiny + tiny) is the double after 1, while (1 + tiny) + tiny rounds to 1: the result tells
  // the order. A new version of Eigen that sums from the front fails here.
  const Vec3 a(1, tiny, tiny), ones(1, 1, 1);
  EXPECT_EQ(a.dot(ones), 1 + 2 * tiny);
  EXPECT_EQ(ones.dot(a), 1 + 2 * tiny);
  EXPECT_EQ((a + Vec3::Zero()).dot(ones), 1 + 2 * tiny);
  EXPECT_EQ(a.transpose().dot(ones), 1 + 2 * tiny);
  EXPECT_EQ(a.sum(), 1 + 2 * tiny);
}

// Six terms are summed as halves: (a + (b + c)) + (d + (e + f)).
TEST(EigenOrder, SixTermsAreSummedUpInHalves) {
  Vec6 a;
  a << 1, tiny, tiny, 0, tiny, tiny;
  EXPECT_EQ(a.dot(Vec6::Ones()), (1 + 2 * tiny) + 2 * tiny);
  a << 1, tiny, 0, 0, tiny, 0;
  EXPECT_EQ(a.dot(Vec6::Ones()), 1);
}

}  // namespace
}  // namespace duet::eigen_order_test
