// Checks that print and record the measured value next to its bound, so that logs show how much margin is
// left.
#pragma once

#include <string>

#include <gtest/gtest.h>

namespace duet::test {

// Prints `what`, `measured` and `bound`, and records them as a property of the running test.
void record_margin(const std::string& what, double measured, const std::string& bound);

// Records the margin, and fails the test unless measured < bound.
void expect_below(double measured, double bound, const std::string& what);

// Records the margin, and fails the test unless measured > bound.
void expect_above(double measured, double bound, const std::string& what);

}  // namespace duet::test
