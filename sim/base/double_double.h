// Sums and products of two doubles without error: s + e for s = round(a + b) and its rounding error e. What
// needs more than 53 bits keeps both (Dekker 1971, "A floating-point technique for extending the available
// precision"). Products are split instead of taken by a fused multiply-add, which not every processor has;
// the results are the same.
#pragma once

namespace duet {

// The number high + low, |low| at most half a unit in the last place of high.
struct DoubleDouble {
  double high = 0, low = 0;
};

// a + b, without error, for any order of their magnitudes (Knuth).
inline DoubleDouble two_sum(double a, double b) {
  const double sum = a + b, part = sum - a;
  return {sum, (a - (sum - part)) + (b - part)};
}

// a + b, without error, where |a| >= |b| or a = 0.
inline DoubleDouble quick_two_sum(double a, double b) {
  const double sum = a + b;
  return {sum, b - (sum - a)};
}

// The upper 26 bits of a and the rest, each short enough for a product without rounding. |a| < 2^996.
inline DoubleDouble split(double a) {
  constexpr double splitter = 0x1p27 + 1;
  const double scaled = splitter * a, high = scaled - (scaled - a);
  return {high, a - high};
}

// a b, without error where nothing overflows or underflows.
inline DoubleDouble two_product(double a, double b) {
  const double product = a * b;
  const DoubleDouble x = split(a), y = split(b);
  return {product, ((x.high * y.high - product) + x.high * y.low + x.low * y.high) + x.low * y.low};
}

// Sums to about 100 bits.
inline DoubleDouble operator+(const DoubleDouble& a, const DoubleDouble& b) {
  const DoubleDouble sum = two_sum(a.high, b.high);
  return quick_two_sum(sum.high, sum.low + (a.low + b.low));
}
inline DoubleDouble operator-(const DoubleDouble& a) { return {-a.high, -a.low}; }
inline DoubleDouble operator-(const DoubleDouble& a, const DoubleDouble& b) { return a + -b; }

}  // namespace duet
