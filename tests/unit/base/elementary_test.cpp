// Compares the elementary functions with MPFR, which rounds correctly. Errors are in units in the last place.
#include "sim/base/elementary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include <gtest/gtest.h>
#include <mpfr.h>

namespace duet::elementary_test {
namespace {

// A number with a mantissa of 200 bits, which makes its own rounding negligible beside that of doubles.
class Precise {
 public:
  explicit Precise(double x = 0) {
    mpfr_init2(value_, 200);
    mpfr_set_d(value_, x, MPFR_RNDN);
  }
  ~Precise() { mpfr_clear(value_); }
  Precise(const Precise&) = delete;
  Precise& operator=(const Precise&) = delete;
  mpfr_ptr get() { return value_; }

  // Returns |x - value| in units in the last place of the value rounded to a double.
  double units_off(double x) {
    const double nearest = mpfr_get_d(value_, MPFR_RNDN);
    if (nearest == 0) return x == 0 ? 0 : std::numeric_limits<double>::infinity();
    const double unit =
        std::max(std::scalbn(1.0, std::ilogb(nearest) - 52), std::numeric_limits<double>::denorm_min());
    Precise difference(x);
    mpfr_sub(difference.get(), difference.get(), value_, MPFR_RNDN);
    return std::abs(mpfr_get_d(difference.get(), MPFR_RNDN)) / unit;
  }

 private:
  mpfr_t value_;
};

using Function = double (*)(double);
using Reference = int (*)(mpfr_ptr, mpfr_srcptr, mpfr_rnd_t);

// Returns the error of `function` at `x` in units in the last place.
double units_off(Function function, Reference reference, double x) {
  Precise value(x);
  reference(value.get(), value.get(), MPFR_RNDN);
  return value.units_off(function(x));
}

double units_off_atan2(double y, double x) {
  Precise value(y), other(x);
  mpfr_atan2(value.get(), value.get(), other.get(), MPFR_RNDN);
  return value.units_off(math::atan2(y, x));
}

// A sequence of random numbers of either sign with magnitudes from 2^`least` to 2^`most`, log-uniform.
class Magnitudes {
 public:
  Magnitudes(int least, int most) : exponent_(least, most) {}
  double operator()() {
    const double x = std::scalbn(mantissa_(engine_), exponent_(engine_));
    return engine_() % 2 == 0 ? x : -x;
  }

 private:
  std::mt19937_64 engine_{7};
  std::uniform_int_distribution<int> exponent_;
  std::uniform_real_distribution<double> mantissa_{1, 2};
};

constexpr int samples = 40000;
constexpr double bound = 0.8;  // units in the last place, as the header states

// The arguments are random and of all magnitudes up to 2^50, the limit of the promise.
TEST(Elementary, SineAndCosineAreWithinTheirBound) {
  Magnitudes next(-40, 49);
  double worst = 0;
  for (int i = 0; i < samples; ++i) {
    const double x = next();
    worst = std::max({worst, units_off(math::sin, mpfr_sin, x), units_off(math::cos, mpfr_cos, x)});
  }
  EXPECT_LT(worst, bound);
}

// Multiples of pi/2 that are rounded to doubles leave the smallest remainders after argument reduction: a
// reduction with too few digits of pi loses all digits here.
TEST(Elementary, SineAndCosineNearTheirZeros) {
  double worst = 0;
  for (int k = 1; k < 20000; ++k)
    for (const double x : {k * (std::numbers::pi / 2), std::nextafter(k * (std::numbers::pi / 2), 0)})
      worst = std::max({worst, units_off(math::sin, mpfr_sin, x), units_off(math::cos, mpfr_cos, -x)});
  // The double whose cosine is the smallest of all, about 2^-61 (Muller, Elementary Functions, table 11.1),
  // has the exponent 797, beyond the range that the header gives a bound for. The double nearest to pi/2 is
  // the worst case within that range.
  worst = std::max(worst, units_off(math::cos, mpfr_cos, 0x1.921fb54442d18p+0));
  EXPECT_LT(worst, bound);
}

// Beyond 2^50, neighboring doubles are more than a quarter of a radian apart. The functions then promise sine
// and cosine of one angle alone, so that rotations stay rotations. Infinity gives NaN.
TEST(Elementary, AnglesBeyondAllDigitsStayOnTheUnitCircle) {
  for (const double x : {0x1p50, 1e17, 1e100, 1e308}) {
    const math::SineCosine p = math::sine_cosine(x);
    EXPECT_NEAR(p.sine * p.sine + p.cosine * p.cosine, 1, 1e-15) << x;
  }
  EXPECT_TRUE(std::isnan(math::sin(std::numeric_limits<double>::infinity())));
}

// The arguments are random and of all magnitudes, with more of them whose quotients are near 1, where the
// octants meet. Arguments of 2^1000 and 2^-1000 must not overflow or underflow in between.
TEST(Elementary, ArctangentIsWithinItsBound) {
  Magnitudes x(-60, 60), near(-6, 6);
  double worst = 0;
  for (int i = 0; i < samples; ++i) {
    worst = std::max(worst, units_off_atan2(x(), x()));
    worst = std::max(worst, units_off_atan2(near(), near()));
  }
  for (const double huge : {0x1p1000, 0x1p-1000, 1e-300})
    worst = std::max({worst, units_off_atan2(huge, 1.7 * huge), units_off_atan2(-huge, -1.1 * huge)});
  EXPECT_LT(worst, bound);
}

// Zeros of either sign and infinities give the values and signs that the C++ standard demands, and NaN gives
// NaN.
TEST(Elementary, ArctangentHasTheSpecialCasesOfTheStandardOne) {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double y : {0.0, -0.0, 1.0, -1.0, infinity, -infinity})
    for (const double x : {0.0, -0.0, 1.0, -1.0, infinity, -infinity}) {
      const double angle = math::atan2(y, x), expected = std::atan2(y, x);
      EXPECT_EQ(angle, expected) << y << ' ' << x;
      EXPECT_EQ(std::signbit(angle), std::signbit(expected)) << y << ' ' << x;
    }
  EXPECT_TRUE(std::isnan(math::atan2(std::nan(""), 1)));
}

// The arguments are random, up to the limits of doubles. Beyond them the result is 0 or infinity; between,
// subnormal results are not flushed to zero.
TEST(Elementary, ExponentialIsWithinItsBound) {
  Magnitudes next(-60, 9);
  double worst = 0;
  for (int i = 0; i < samples; ++i) {
    const double x = next();
    if (x > -708 && x < 709.7) worst = std::max(worst, units_off(math::exp, mpfr_exp, x));
  }
  EXPECT_LT(worst, bound);
  EXPECT_EQ(math::exp(0), 1);
  EXPECT_EQ(math::exp(-800), 0);
  EXPECT_EQ(math::exp(800), std::numeric_limits<double>::infinity());
  EXPECT_GT(math::exp(-744), 0);
}

// The arguments are random and of all magnitudes, subnormal ones included; cubes of small integers and zero
// have exact roots.
TEST(Elementary, CubeRootIsWithinItsBound) {
  Magnitudes next(-1070, 1020);
  double worst = 0;
  for (int i = 0; i < samples; ++i) worst = std::max(worst, units_off(math::cbrt, mpfr_cbrt, next()));
  EXPECT_LT(worst, bound);
  EXPECT_EQ(math::cbrt(-27), -3);
  EXPECT_EQ(math::cbrt(0), 0);
}

// The arguments are random, with squares that neither overflow nor underflow.
TEST(Elementary, HypotenuseIsWithinItsBound) {
  Magnitudes next(-100, 100);
  double worst = 0;
  for (int i = 0; i < samples; ++i) {
    const double x = next(), y = next();
    Precise value(x), other(y);
    mpfr_hypot(value.get(), value.get(), other.get(), MPFR_RNDN);
    worst = std::max(worst, value.units_off(math::hypot(x, y)));
  }
  EXPECT_LT(worst, bound);
}

}  // namespace
}  // namespace duet::elementary_test
