// Checks that print what they measured next to their bound, so that a log shows how much room is left.
#pragma once

#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace duet::test {

inline void record_margin(const std::string& what, double measured, const std::string& bound) {
  fmt::print("  {}: {:.4g} ({})\n", what, measured, bound);
  testing::Test::RecordProperty(what, fmt::format("{:.6g} ({})", measured, bound));
}

inline void expect_below(double measured, double bound, const std::string& what) {
  record_margin(what, measured, fmt::format("below {:.4g}", bound));
  EXPECT_LT(measured, bound) << what;
}

inline void expect_above(double measured, double bound, const std::string& what) {
  record_margin(what, measured, fmt::format("above {:.4g}", bound));
  EXPECT_GT(measured, bound) << what;
}

}  // namespace duet::test
