#include "sim/base/near_miss.h"

#include <gtest/gtest.h>

namespace duet::near_miss_test {
namespace {

TEST(NearMiss, EditDistance) {
  EXPECT_EQ(edit_distance("", ""), 0);
  EXPECT_EQ(edit_distance("", "abc"), 3);
  EXPECT_EQ(edit_distance("abc", ""), 3);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
  EXPECT_EQ(edit_distance("friction", "firction"), 1) << "a swap of neighbors is one slip";
  EXPECT_EQ(edit_distance("Mass", "mass"), 0) << "case does not count";
}

TEST(NearMiss, FindsTheClosestWord) {
  EXPECT_EQ(near_miss("frction", {"fraction", "friction", "mass"}), "fraction") << "the first of equals";
  EXPECT_EQ(near_miss("fricton", {"fraction", "friction", "mass"}), "friction");
  EXPECT_EQ(near_miss("velocity", {"mass", "look"}), std::nullopt);
  EXPECT_EQ(near_miss("x", {"y"}), std::nullopt) << "one letter replaced by another says nothing";
  EXPECT_EQ(near_miss("", {"y"}), std::nullopt);
}

// `pin` is one letter from "min", but a user of other programs means `least`.
TEST(NearMiss, KnowsTheWordsOfOtherPrograms) {
  EXPECT_EQ(near_miss("min", {"pin", "least", "most"}), "least");
  EXPECT_EQ(near_miss("min", {"pin", "mass"}), "pin") << "where there is no `least`";
  EXPECT_EQ(did_you_mean("fov", {"position", "vertical_fov"}), "did you mean `vertical_fov`?");
}

TEST(NearMiss, HintFallsBackToAllKnownWords) {
  EXPECT_EQ(did_you_mean("mas", {"mass", "look"}), "did you mean `mass`?");
  EXPECT_EQ(did_you_mean("velocity", {"mass", "look"}), "known: mass, look");
  EXPECT_EQ(did_you_mean("velocity", {}), "");
}

}  // namespace
}  // namespace duet::near_miss_test
