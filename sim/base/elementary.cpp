#include "sim/base/elementary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "sim/base/double_double.h"

namespace duet::math {
namespace {

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

// Returns 1/n! for n < 20.
constexpr std::array<double, 20> inverse_factorials() {
  std::array<double, 20> inverse{};
  double factorial = 1;  // exact up to 22!
  for (int n = 0; n < 20; ++n) {
    if (n > 0) factorial *= n;
    inverse[static_cast<std::size_t>(n)] = 1 / factorial;
  }
  return inverse;
}
constexpr std::array<double, 20> over_factorial = inverse_factorials();

// Returns the sum over k >= 0 of (-z)^k / (n + 2k)!, up to the last factorial below 20!. It is the tail of
// the series of a sine or cosine after its first terms.
double alternating_series(std::size_t n, double z) {
  std::size_t last = n;
  while (last + 2 < over_factorial.size()) last += 2;
  double sum = over_factorial[last];
  for (std::size_t k = last; k > n; k -= 2) sum = over_factorial[k - 2] - z * sum;
  return sum;
}

// pi/2 as the sum of three doubles, with 160 bits together.
constexpr double half_pi[3] = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54, -0x1.f1976b7ed8fbcp-110};
constexpr DoubleDouble pi = {2 * half_pi[0], 2 * half_pi[1]};

// x = quarter pi/2 + rest, where |rest| exceeds pi/4 by rounding at most.
struct ReducedAngle {
  DoubleDouble rest;
  int quarter;  // modulo 4
};

// Reduces an angle x (rad) to the multiple of pi/2 nearest to it and the rest.
ReducedAngle reduce(double x) {
  if (std::abs(x) < 0.785) return {{x, 0}, 0};
  if (!(std::abs(x) < 0x1p50)) x = std::remainder(x, 2 * half_pi[0]);  // exact by the C standard
  const double quarters = std::floor(x * (1 / half_pi[0]) + 0.5);
  const DoubleDouble first = two_product(quarters, half_pi[0]), second = two_product(quarters, half_pi[1]);
  const DoubleDouble rest = ((two_sum(x, -first.high) - DoubleDouble{first.low, 0}) - second) -
                            DoubleDouble{quarters * half_pi[2], 0};
  return {rest, static_cast<int>(std::fmod(quarters, 4)) & 3};
}

// Returns x + (-x^3/3! + ...): the sine of x.high + x.low, to first order in x.low.
double sine_of(const DoubleDouble& x) {
  const double z = x.high * x.high;
  return x.high + (x.low * (1 - 0.5 * z) - x.high * (z * alternating_series(3, z)));
}

// Returns 1 - x^2/2 + (x^4/4! - ...): the cosine of x.high + x.low. The rounding error of the first two terms
// is added back.
double cosine_of(const DoubleDouble& x) {
  const DoubleDouble square = two_product(x.high, x.high);
  const double z = square.high;
  const DoubleDouble first = quick_two_sum(1, -0.5 * z);
  return first.high + (first.low + (z * z * alternating_series(4, z) - (0.5 * square.low + x.high * x.low)));
}

// arctan(k/16) as double-doubles, for k = 0, ..., 16.
constexpr DoubleDouble arctangent_of_sixteenth[17] = {
    {0, 0},
    {0x1.ff55bb72cfdeap-5, -0x1.c934d86d23f1dp-60},
    {0x1.fd5ba9aac2f6ep-4, -0x1.cd37686760c17p-59},
    {0x1.7b97b4bce5b02p-3, 0x1.347b0b4f881cap-58},
    {0x1.f5b75f92c80ddp-3, 0x1.8ab6e3cf7afbdp-57},
    {0x1.362773707ebccp-2, -0x1.963a544b672d8p-57},
    {0x1.6f61941e4def1p-2, -0x1.c63aae6f6e918p-56},
    {0x1.a64eec3cc23fdp-2, -0x1.24dec1b50b7ffp-56},
    {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
    {0x1.0657e94db30dp-1, -0x1.d5b495f6349e6p-56},
    {0x1.1e00babdefeb4p-1, -0x1.928df287a668fp-58},
    {0x1.345f01cce37bbp-1, 0x1.1021137c71102p-55},
    {0x1.4978fa3269ee1p-1, 0x1.2419a87f2a458p-56},
    {0x1.5d58987169b18p-1, 0x1.0028e4bc5e7cap-57},
    {0x1.700a7c5784634p-1, -0x1.8c34d25aadef6p-56},
    {0x1.819d0b7158a4dp-1, -0x1.bf76229d3b917p-56},
    {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55},
};

// Returns arctan(y/x) for 0 <= y <= x and 2^-30 <= y/x. With c = k/16 next to y/x, arctan(y/x) = arctan(c) +
// arctan(u), u = (y - c x)/(x + c y), |u| <= 1/32.
DoubleDouble arctangent(double y, double x) {
  const double k = std::floor(16 * (y / x) + 0.5), c = k / 16;
  const DoubleDouble above = DoubleDouble{y, 0} - two_product(c, x),
                     below = DoubleDouble{x, 0} + two_product(c, y);
  const double u = above.high / below.high;
  const DoubleDouble back = two_product(u, below.high);  // gives the rounding error of the quotient
  const double rest = (((above.high - back.high) - back.low) + (above.low - u * below.low)) / below.high;
  const double z = u * u;
  double series = 0;  // arctan(u) = u + u series
  for (int n = 13; n >= 3; n -= 2) series = z * ((n % 4 == 3 ? -1.0 : 1.0) / n + series);
  return arctangent_of_sixteenth[static_cast<int>(k)] + quick_two_sum(u, rest + u * series);
}

}  // namespace

SineCosine sine_cosine(double x) {
  if (!std::isfinite(x)) return {not_a_number, not_a_number};
  const ReducedAngle angle = reduce(x);
  const double s = sine_of(angle.rest), c = cosine_of(angle.rest);
  switch (angle.quarter) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

double sin(double x) { return sine_cosine(x).sine; }
double cos(double x) { return sine_cosine(x).cosine; }

double atan2(double y, double x) {
  if (std::isnan(x) || std::isnan(y)) return not_a_number;
  double a = std::abs(x), b = std::abs(y);
  if (std::isinf(a) || std::isinf(b)) {  // same directions as the sides and corners of a square
    a = std::isinf(a) ? 1 : 0;
    b = std::isinf(b) ? 1 : 0;
  }
  const bool steep = b > a;
  if (steep) std::swap(a, b);
  DoubleDouble angle;
  if (a > 0) {
    const int exponent = std::ilogb(a);
    a = std::scalbn(a, -exponent);
    const double scaled = std::scalbn(b, -exponent);
    if (scaled >= 0x1p-30 * a)
      angle = arctangent(scaled, a);
    else if (!steep && !std::signbit(x))
      return std::copysign(std::scalbn(b / a, -exponent), y);  // arctan(t) = t (1 - t^2/3 + ...)
    else
      angle = {scaled / a, 0};
  }
  if (steep) angle = DoubleDouble{half_pi[0], half_pi[1]} - angle;
  if (std::signbit(x)) angle = pi - angle;
  return std::copysign(angle.high + angle.low, y);
}

double exp(double x) {
  if (std::isnan(x)) return not_a_number;
  if (x > 710) return std::numeric_limits<double>::infinity();
  if (x < -746) return 0;
  // x = k ln 2 + r. The product of k and the first part of ln 2 is exact.
  constexpr double ln2_high = 0x1.62e42fefa38p-1, ln2_low = 0x1.ef35793c7673p-45;
  const double k = std::floor(x * (1 / 0x1.62e42fefa39efp-1) + 0.5);
  const DoubleDouble r = two_sum(x - k * ln2_high, -(k * ln2_low));
  double series = over_factorial[15];  // e^r = 1 + r + r^2 series
  for (std::size_t n = 15; n > 2; --n) series = over_factorial[n - 1] + r.high * series;
  const DoubleDouble first = quick_two_sum(1, r.high);
  return std::scalbn(first.high + (first.low + (r.low + r.high * r.high * series)), static_cast<int>(k));
}

double cbrt(double x) {
  if (x == 0 || !std::isfinite(x)) return x;
  int exponent = 0;
  double m = std::frexp(std::abs(x), &exponent);  // in [1/2, 1)
  while (exponent % 3 != 0) {
    m /= 2;
    ++exponent;
  }
  double y = 0.38 + 0.62 * m;  // within a sixth of the root for m in [1/8, 1)
  for (int i = 0; i < 4; ++i) y -= (y - m / (y * y)) / 3;
  // One more step of Newton's method takes y^3 with twice the digits.
  const DoubleDouble square = two_product(y, y), cube = two_product(square.high, y);
  const double excess = (cube.high - m) + (cube.low + square.low * y);
  y -= excess / (3 * square.high);
  return std::copysign(std::scalbn(y, exponent / 3), x);
}

double hypot(double x, double y) {
  const DoubleDouble a = two_product(x, x), b = two_product(y, y), sum = two_sum(a.high, b.high);
  if (sum.high == 0) return 0;
  const double root = std::sqrt(sum.high);
  const DoubleDouble square = two_product(root, root);
  return root + ((sum.high - square.high) + (sum.low + (a.low + b.low) - square.low)) / (2 * root);
}

}  // namespace duet::math
