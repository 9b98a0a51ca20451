// Sums and products of two doubles without error: s + e with s = round(a + b) and its rounding error e. Code
// that needs more than 53 bits keeps both parts (Dekker 1971, "A floating-point technique for extending the
// available precision"). Products are split instead of taken by a fused multiply-add, which not every
// processor has; the results are the same.
#pragma once

namespace duet {

/// The number high + low, where |low| is at most half a unit in the last place of high.
struct DoubleDouble {
  double high = 0,  ///< The leading part.
      low = 0;      ///< The rounding error that `high` leaves.
};

/// Returns a + b without error, whichever of them is larger in magnitude (Knuth, The Art of Computer
/// Programming, volume 2, section 4.2.2).
inline DoubleDouble two_sum(double a, double b) {
  const double sum = a + b, part = sum - a;
  return {sum, (a - (sum - part)) + (b - part)};
}

/// Returns a + b without error. Requires |a| >= |b| or a = 0.
inline DoubleDouble quick_two_sum(double a, double b) {
  const double sum = a + b;
  return {sum, b - (sum - a)};
}

/// Splits `a` into its upper 26 bits and the rest, whose products need no rounding. Requires |a| < 2^996.
inline DoubleDouble split(double a) {
  constexpr double splitter = 0x1p27 + 1;
  const double scaled = splitter * a, high = scaled - (scaled - a);
  return {high, a - high};
}

/// Returns a b without error, unless an intermediate value overflows or underflows.
inline DoubleDouble two_product(double a, double b) {
  const double product = a * b;
  const DoubleDouble x = split(a), y = split(b);
  return {product, ((x.high * y.high - product) + x.high * y.low + x.low * y.high) + x.low * y.low};
}

/// Returns a + b, accurate to about 100 bits.
inline DoubleDouble operator+(const DoubleDouble& a, const DoubleDouble& b) {
  const DoubleDouble sum = two_sum(a.high, b.high);
  return quick_two_sum(sum.high, sum.low + (a.low + b.low));
}
/// Returns -a, exactly.
inline DoubleDouble operator-(const DoubleDouble& a) { return {-a.high, -a.low}; }
/// Returns a - b, accurate to about 100 bits.
inline DoubleDouble operator-(const DoubleDouble& a, const DoubleDouble& b) { return a + -b; }

}  // namespace duet
