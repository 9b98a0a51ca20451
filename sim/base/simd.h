// Packs: eight doubles at once, with the same results on every machine, because every operation is a
// correctly rounded one of IEEE 754. A pack is one AVX-512 register or two vectors of four doubles (see
// double4.h).
#pragma once

#include <cmath>
#include <cstddef>
#include <type_traits>

#include "sim/base/double4.h"

namespace duet {

/// Number of lanes of a pack.
inline constexpr std::size_t pack_width = 8;
#if defined(__AVX512F__)
/// Eight doubles.
using double8 = double __attribute__((vector_size(8 * pack_width)));
#else
/// Eight doubles.
using double8 = double4x2;
#endif
/// The result of comparing packs: in each lane all bits are set where the comparison holds, and none
/// elsewhere.
using mask8 = decltype(double8{} < double8{});

/// Eight floats, for places where single precision is enough: they halve the memory traffic.
using float8 = float __attribute__((vector_size(4 * pack_width)));

/// Eight 3-vectors, stored by coordinate. `P` is double8 or float8.
template <class P>
struct VectorOf {
  P x{},    ///< The x coordinates of all lanes.
      y{},  ///< The y coordinates of all lanes.
      z{};  ///< The z coordinates of all lanes.
};
/// Eight 3-vectors of doubles.
using vector8 = VectorOf<double8>;
/// Eight 3-vectors of floats.
using vector8f = VectorOf<float8>;

/// Returns the natural logarithm of positive normal numbers, to 2 units in the last place. x = 2^k m with m
/// in [sqrt(1/2), sqrt(2)], and ln m = 2 artanh(s) with s = (m - 1)/(m + 1), whose series needs 11 terms for
/// |s| < 0.172. `V` is a compiler vector of doubles. Other arguments give meaningless results.
template <class V>
V log_of_lanes(const V& x) {
  using Bits = decltype(V{} < V{});
  const Bits bits = reinterpret_cast<Bits>(x);
  constexpr long one = 0x3ff0000000000000, mantissa_bits = 0x000fffffffffffff;
  V m = reinterpret_cast<V>((bits & mantissa_bits) | one);
  V k = __builtin_convertvector((bits >> 52) - 1023, V);
  const Bits upper = m > 0x1.6a09e667f3bcdp+0;  // sqrt(2)
  m = upper ? 0.5 * m : m;
  k = upper ? k + 1.0 : k;
  const V s = (m - 1.0) / (m + 1.0), z = s * s;
  V series = V{} + 1.0 / 21;
  for (int n = 19; n >= 3; n -= 2) series = 1.0 / n + z * series;
  // ln 2 in two parts. The product of k and the first part is exact.
  constexpr double ln2_high = 0x1.62e42fefa38p-1,
                   ln2_low = 0x1.ef35793c7673p-45;  // k times the first is exact
  return k * ln2_high + (2.0 * s + (2.0 * s * z * series + k * ln2_low));
}

/// Returns the first three entries of the rows row(0), ..., row(7) by coordinate, as compiler vectors of
/// eight. `Row` is callable and returns a double4 or a float4.
template <class Row>
auto load_eight(Row&& row) {
  const auto pair = [&](std::size_t i) {
    return __builtin_shufflevector(row(i), row(i + 4), 0, 1, 2, 3, 4, 5, 6, 7);
  };
  const auto a = pair(0), b = pair(1), c = pair(2), d = pair(3);
  const auto xy_even = __builtin_shufflevector(a, b, 0, 8, 1, 9, 4, 12, 5, 13);
  const auto xy_odd = __builtin_shufflevector(c, d, 0, 8, 1, 9, 4, 12, 5, 13);
  const auto z_even = __builtin_shufflevector(a, b, 2, 10, 3, 11, 6, 14, 7, 15);
  const auto z_odd = __builtin_shufflevector(c, d, 2, 10, 3, 11, 6, 14, 7, 15);
  return VectorOf<std::remove_cvref_t<decltype(pair(0))>>{
      __builtin_shufflevector(xy_even, xy_odd, 0, 1, 8, 9, 4, 5, 12, 13),
      __builtin_shufflevector(xy_even, xy_odd, 2, 3, 10, 11, 6, 7, 14, 15),
      __builtin_shufflevector(z_even, z_odd, 0, 1, 8, 9, 4, 5, 12, 13)};
}

// The functions below have one definition for double8 and one for float8.
#if defined(__AVX512F__)
/// Returns `a` in the lanes where `condition` holds and `b` in the others.
inline double8 select(const mask8& condition, const double8& a, const double8& b) {
  return condition ? a : b;
}
/// Returns the square root in each lane, correctly rounded.
inline double8 sqrt_of(const double8& x) { return _mm512_maskz_sqrt_pd(0xff, x); }
/// Returns the natural logarithm in each lane; see log_of_lanes().
inline double8 log_of(const double8& x) { return log_of_lanes(x); }
/// Returns a bit for each lane in which the mask is set: bit i for lane i.
inline unsigned lanes_of(const mask8& mask) {
  return _mm512_cmp_epi64_mask(reinterpret_cast<__m512i>(mask), __m512i{}, _MM_CMPINT_NE);
}
/// Rounds each lane to single precision.
inline float8 to_single(const double8& x) { return __builtin_convertvector(x, float8); }
/// Converts each lane to double precision, exactly.
inline double8 to_double(const float8& x) { return __builtin_convertvector(x, double8); }
/// Returns the first three entries of the rows row(0), ..., row(7) by coordinate. `Row` is callable; rows of
/// double4 give a vector8, rows of float4 a vector8f.
template <class Row>
auto load_rows(Row&& row) {
  return load_eight(row);
}
/// Writes the eight rows (x, y, z, w) to `out`, one double4 for each lane.
inline void store_rows(const vector8& v, const double8& w, double4* out) {
  const double8 xy_low = __builtin_shufflevector(v.x, v.y, 0, 8, 1, 9, 2, 10, 3, 11);
  const double8 xy_high = __builtin_shufflevector(v.x, v.y, 4, 12, 5, 13, 6, 14, 7, 15);
  const double8 z_low = __builtin_shufflevector(v.z, w, 0, 8, 1, 9, 2, 10, 3, 11);
  const double8 z_high = __builtin_shufflevector(v.z, w, 4, 12, 5, 13, 6, 14, 7, 15);
  out[0] = __builtin_shufflevector(xy_low, z_low, 0, 1, 8, 9);
  out[1] = __builtin_shufflevector(xy_low, z_low, 2, 3, 10, 11);
  out[2] = __builtin_shufflevector(xy_low, z_low, 4, 5, 12, 13);
  out[3] = __builtin_shufflevector(xy_low, z_low, 6, 7, 14, 15);
  out[4] = __builtin_shufflevector(xy_high, z_high, 0, 1, 8, 9);
  out[5] = __builtin_shufflevector(xy_high, z_high, 2, 3, 10, 11);
  out[6] = __builtin_shufflevector(xy_high, z_high, 4, 5, 12, 13);
  out[7] = __builtin_shufflevector(xy_high, z_high, 6, 7, 14, 15);
}
#else
/// Returns the natural logarithm in each lane; see log_of_lanes().
inline double8 log_of(const double8& x) { return {log_of_lanes(x.low), log_of_lanes(x.high)}; }
/// Rounds each lane to single precision.
inline float8 to_single(const double8& x) {
  return __builtin_shufflevector(__builtin_convertvector(x.low, float4),
                                 __builtin_convertvector(x.high, float4), 0, 1, 2, 3, 4, 5, 6, 7);
}
/// Converts each lane to double precision, exactly.
inline double8 to_double(const float8& x) {
  return {__builtin_convertvector(__builtin_shufflevector(x, x, 0, 1, 2, 3), double4),
          __builtin_convertvector(__builtin_shufflevector(x, x, 4, 5, 6, 7), double4)};
}
/// Returns the first three entries of the rows row(0), ..., row(7) by coordinate. `Row` is callable; rows of
/// double4 give a vector8, rows of float4 a vector8f.
template <class Row>
auto load_rows(Row&& row) {
  if constexpr (std::is_same_v<std::remove_cvref_t<decltype(row(0))>, float4>) {
    return load_eight(row);
  } else {
    const FirstThree low = load_four(row(0), row(1), row(2), row(3));
    const FirstThree high = load_four(row(4), row(5), row(6), row(7));
    return vector8{{low.x, high.x}, {low.y, high.y}, {low.z, high.z}};
  }
}
/// Writes the eight rows (x, y, z, w) to `out`, one double4 for each lane.
inline void store_rows(const vector8& v, const double8& w, double4* out) {
  store_four(v.x.low, v.y.low, v.z.low, w.low, out);
  store_four(v.x.high, v.y.high, v.z.high, w.high, out + 4);
}
#endif
/// Returns whether the mask is set in any lane.
inline bool any_of(const mask8& condition) { return lanes_of(condition) != 0; }

// The functions below let formulas be written once for T = double, T = double8 and, as far as needed, T =
// float8.

/// Returns `a` if `condition` holds, else `b`.
inline double select(bool condition, double a, double b) { return condition ? a : b; }
/// Returns the larger of `a` and `b`, in each lane of packs; `b` if one of them is NaN.
template <class T>
T max_of(const T& a, const T& b) {
  return select(a > b, a, b);
}
/// Returns the smaller of `a` and `b`, in each lane of packs; `b` if one of them is NaN.
template <class T>
T min_of(const T& a, const T& b) {
  return select(a < b, a, b);
}
/// Returns the magnitude of `a`, in each lane of packs. It keeps the sign of -0.
template <class T>
T abs_of(const T& a) {
  return select(a < T{}, -a, a);
}
/// Returns the square root of `x`.
inline double sqrt_of(double x) { return std::sqrt(x); }
/// Returns the natural logarithm of `x`, with the bits that packs give.
inline double log_of(double x) { return log_of_lanes(double4{} + x)[0]; }

}  // namespace duet
