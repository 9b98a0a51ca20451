// Chooses how many of its cases a test looks at.
#pragma once

namespace duet::test {

// Returns whether the environment has DUET_FULL, as in the tests with the label `long` that `tools/test
// --full` runs.
bool runs_in_full();

// Chooses among the cases of nested loops: all of them in the long tests, else the first and every
// `stride`-th after it. A stride meets every value of every loop if it is coprime to the number of values of
// each inner loop and no greater than the number of cases for one value of the outermost loop.
class Cases {
 public:
  // In long tests the stride is 1.
  explicit Cases(int stride);
  // Returns whether the test shall look at the next case. To be called once for each case, in order.
  bool takes();
  // Returns how many cases have been offered to takes().
  int offered() const { return offered_; }
  // Returns how many cases takes() has chosen.
  int taken() const { return taken_; }

 private:
  int stride_;
  int offered_ = 0, taken_ = 0;
};

}  // namespace duet::test
