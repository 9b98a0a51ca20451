// Checks that print what they measured next to their bound, so that a log shows how much room is left.
#pragma once

#include <string>

#include <gtest/gtest.h>

namespace duet::test {

void record_margin(const std::string& what, double measured, const std::string& bound);

void expect_below(double measured, double bound, const std::string& what);

void expect_above(double measured, double bound, const std::string& what);

}  // namespace duet::test
