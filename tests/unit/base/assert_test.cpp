#include "sim/base/assert.h"

#include <gtest/gtest.h>

#include "sim/base/index.h"

namespace duet::assert_test {
namespace {

// A failed assertion ends the program with a message that names the place and the condition.
TEST(Assert, EndsTheProgramWithTheConditionAndItsPlace) {
  EXPECT_DEATH(detail::end_at_assertion("a < b", "here.cpp", 7), "here.cpp:7: a < b does not hold");
}

// DUET_ASSERT evaluates its condition only in builds with DUET_ASSERTS, where as_index(-1) ends the program.
// A condition with an effect would behave differently in the two kinds of builds.
TEST(Assert, IsEvaluatedWhereItIsOnAlone) {
  int evaluated = 0;
  DUET_ASSERT(++evaluated > 0);
#ifdef DUET_ASSERTS
  EXPECT_EQ(evaluated, 1);
  EXPECT_DEATH(as_index(-1), "i >= 0 does not hold");
#else
  EXPECT_EQ(evaluated, 0);
#endif
  EXPECT_EQ(as_index(3), 3U);
}

}  // namespace
}  // namespace duet::assert_test
