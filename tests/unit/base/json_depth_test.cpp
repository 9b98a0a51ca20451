// Tests of the depth of JSON texts.
#include "sim/base/json_depth.h"

#include <string>

#include <gtest/gtest.h>

namespace duet::json_depth_test {
namespace {

TEST(JsonDepth, CountsOpenBracketsOutsideOfStrings) {
  EXPECT_EQ(json_depth(""), 0U);
  EXPECT_EQ(json_depth("1"), 0U);
  EXPECT_EQ(json_depth(R"({"a": [1, 2], "b": [[3]]})"), 3U);
  EXPECT_EQ(json_depth(R"(["[[[[", "\"[[", "\\", [1]])"), 2U);
  EXPECT_EQ(json_depth("]]]][["), 2U);
  EXPECT_EQ(json_depth(std::string(100000, '[')), 100000U);
}

}  // namespace
}  // namespace duet::json_depth_test
