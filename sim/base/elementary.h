// Elementary functions that give the same bits on every machine. The C library picks variants of its own by
// the processor, and its versions differ in last bits, so whatever feeds the state calls these instead. They
// are made of sums, products, quotients and square roots of doubles alone, each correctly rounded by IEEE
// 754.
//
// Errors are below 0.8 units in the last place of the result; tests/unit/base/elementary_test.cpp compares
// them with MPFR. NaN gives NaN.
#pragma once

namespace duet::math {

struct SineCosine {
  double sine, cosine;
};

/// sin(x) and cos(x) of an angle in radians. Accurate for |x| < 2^50; beyond, where neighboring doubles are
/// more than a quarter of a radian apart, some point of the unit circle. Infinite angles give NaN.
SineCosine sine_cosine(double x);
double sin(double x);
double cos(double x);

/// The angle of the point (x, y) from the x axis, from -pi to pi, with the signs of zeros and the infinite
/// cases of std::atan2.
double atan2(double y, double x);

/// e^x; infinity above 709.78, 0 below -745.13, accurate to a unit of the smallest number where it is
/// subnormal.
double exp(double x);

/// The cube root of any finite number, with its sign.
double cbrt(double x);

/// sqrt(x^2 + y^2), for numbers whose squares neither overflow nor underflow; up to 1 unit in the last place
/// off.
double hypot(double x, double y);

}  // namespace duet::math
