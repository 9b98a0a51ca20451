// How much of its cases a test looks at.
#pragma once

namespace duet::test {

/// True in the tests with the label `long`, which `tools/test --full` runs with DUET_FULL in their
/// environment.
bool runs_in_full();

/// Chooses among the cases of nested loops: all of them in the long tests, else the first and every
/// `stride`-th after it. A stride that has no divisor in common with the number of values of an inner loop,
/// and is no greater than the number of cases for one value of the outermost loop, meets every value of every
/// loop.
class Cases {
 public:
  explicit Cases(int stride);
  /// Called once for each case, in order: whether the test looks at it.
  bool takes();
  /// How many cases have been offered to takes().
  int offered() const { return offered_; }
  /// How many of them takes() has chosen.
  int taken() const { return taken_; }

 private:
  int stride_;
  int offered_ = 0, taken_ = 0;
};

}  // namespace duet::test
