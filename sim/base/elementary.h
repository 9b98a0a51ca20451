// Elementary functions that give the same bits on every machine. The C library picks variants by the
// processor, and its versions differ in their last bits, so code that feeds the state calls these functions
// instead. They consist of sums, products, quotients and square roots of doubles alone, which IEEE 754 rounds
// correctly.
//
// Unless a function says otherwise, errors are below 0.8 units in the last place of the result;
// tests/unit/base/elementary_test.cpp compares them with MPFR. NaN gives NaN.
#pragma once

namespace duet::math {

/// The sine and cosine of one angle.
struct SineCosine {
  double sine,  ///< In [-1, 1].
      cosine;   ///< In [-1, 1].
};

/// Returns the sine and cosine of an angle `x` in radians. Both are accurate for |x| < 2^50. Beyond that,
/// neighboring doubles are more than a quarter of a radian apart, and the result is only guaranteed to lie on
/// the unit circle. Infinite angles give NaN.
SineCosine sine_cosine(double x);
/// Returns the sine of an angle `x` in radians; see sine_cosine().
double sin(double x);
/// Returns the cosine of an angle `x` in radians; see sine_cosine().
double cos(double x);

/// Returns the angle of the point (x, y) from the x axis in radians, from -pi to pi. Signed zeros and
/// infinite arguments are treated as by std::atan2.
double atan2(double y, double x);

/// Returns e^x. The result is infinity above x = 709.78 and 0 below x = -745.13. A subnormal result is
/// accurate to one unit of the smallest positive double.
double exp(double x);

/// Returns the cube root of `x`, with its sign. Zeros and infinities are returned unchanged.
double cbrt(double x);

/// Returns sqrt(x^2 + y^2). The error is up to 1 unit in the last place. Requires that the squares neither
/// overflow nor underflow.
double hypot(double x, double y);

}  // namespace duet::math
