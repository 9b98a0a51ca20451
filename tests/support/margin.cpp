#include "tests/support/margin.h"

#include <fmt/format.h>

namespace duet::test {

void record_margin(const std::string& what, double measured, const std::string& bound) {
  fmt::print("  {}: {:.4g} ({})\n", what, measured, bound);
  testing::Test::RecordProperty(what, fmt::format("{:.6g} ({})", measured, bound));
}

void expect_below(double measured, double bound, const std::string& what) {
  record_margin(what, measured, fmt::format("below {:.4g}", bound));
  EXPECT_LT(measured, bound) << what;
}

void expect_above(double measured, double bound, const std::string& what) {
  record_margin(what, measured, fmt::format("above {:.4g}", bound));
  EXPECT_GT(measured, bound) << what;
}

}  // namespace duet::test
