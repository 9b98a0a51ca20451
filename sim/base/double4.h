// Eight doubles as two vectors of four, for machines whose vectors are no wider. A wider compiler vector type
// would go through memory between operations: with AVX2, elastic forces took 1.5 to 1.75 times as long.
#pragma once

#include <cmath>
#include <cstddef>

#if defined(__AVX__)
#include <immintrin.h>
#endif

namespace duet {

/// A row of four doubles, as records lie in memory.
using double4 = double __attribute__((vector_size(32)));
/// A row of four floats, as records lie in memory.
using float4 = float __attribute__((vector_size(16)));
/// The result of comparing Quads: four 64-bit integers with all bits set where the comparison holds, and none
/// elsewhere.
using mask4 = decltype(double4{} < double4{});

/// Returns the square root in each lane, correctly rounded.
inline double4 sqrt_of(const double4& x) {
#if defined(__AVX__)
  return _mm256_sqrt_pd(x);
#else
  return double4{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
#endif
}
/// Returns `a` in the lanes where `condition` holds and `b` in the others.
inline double4 select(const mask4& condition, const double4& a, const double4& b) {
  return condition ? a : b;
}
/// Returns a bit for each lane in which the mask is set: bit i for lane i.
inline unsigned lanes_of(const mask4& mask) {
#if defined(__AVX__)
  return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask)));
#else
  unsigned bits = 0;
  for (unsigned lane = 0; lane < 4; ++lane) bits |= mask[lane] != 0 ? 1u << lane : 0u;
  return bits;
#endif
}

/// The result of comparing double4x2.
struct mask4x2 {
  mask4 low,  ///< Lanes 0 to 3.
      high;   ///< Lanes 4 to 7.
  /// Returns where both masks are set.
  friend mask4x2 operator&(const mask4x2& a, const mask4x2& b) { return {a.low & b.low, a.high & b.high}; }
};

/// Eight doubles, with those operators of a compiler vector type that the program uses. Each operator works
/// lane by lane.
struct alignas(64) double4x2 {
  double4 low,  ///< Lanes 0 to 3.
      high;     ///< Lanes 4 to 7.

  /// Returns the lane for writing. The cast is legal: a vector type shares the aliasing of its elements.
  double& operator[](std::size_t lane) { return reinterpret_cast<double*>(&low)[lane]; }
  /// Returns the value of a lane.
  double operator[](std::size_t lane) const { return lane < 4 ? low[lane] : high[lane - 4]; }

  /// Short name for the declarations below.
  using V = double4x2;
  friend V operator-(const V& a) { return {-a.low, -a.high}; }                             ///< Returns -a.
  friend V operator+(const V& a, const V& b) { return {a.low + b.low, a.high + b.high}; }  ///< Returns a + b.
  friend V operator-(const V& a, const V& b) { return {a.low - b.low, a.high - b.high}; }  ///< Returns a - b.
  friend V operator*(const V& a, const V& b) { return {a.low * b.low, a.high * b.high}; }  ///< Returns a b.
  friend V operator/(const V& a, const V& b) { return {a.low / b.low, a.high / b.high}; }  ///< Returns a / b.
  friend V operator+(const V& a, double b) { return {a.low + b, a.high + b}; }             ///< Returns a + b.
  friend V operator-(const V& a, double b) { return {a.low - b, a.high - b}; }             ///< Returns a - b.
  friend V operator*(const V& a, double b) { return {a.low * b, a.high * b}; }             ///< Returns a b.
  friend V operator/(const V& a, double b) { return {a.low / b, a.high / b}; }             ///< Returns a / b.
  friend V operator+(double a, const V& b) { return {a + b.low, a + b.high}; }             ///< Returns a + b.
  friend V operator-(double a, const V& b) { return {a - b.low, a - b.high}; }             ///< Returns a - b.
  friend V operator*(double a, const V& b) { return {a * b.low, a * b.high}; }             ///< Returns a b.
  friend V operator/(double a, const V& b) { return {a / b.low, a / b.high}; }             ///< Returns a / b.
  /// Adds `b`, a double4x2 or a double.
  template <class T>
  V& operator+=(const T& b) {
    return *this = *this + b;
  }
  /// Multiplies by `b`, a double4x2 or a double.
  template <class T>
  V& operator*=(const T& b) {
    return *this = *this * b;
  }

  /// Returns where a < b.
  friend mask4x2 operator<(const V& a, const V& b) { return {a.low < b.low, a.high < b.high}; }
  /// Returns where a > b.
  friend mask4x2 operator>(const V& a, const V& b) { return {a.low > b.low, a.high > b.high}; }
  /// Returns where a <= b.
  friend mask4x2 operator<=(const V& a, const V& b) { return {a.low <= b.low, a.high <= b.high}; }
  /// Returns where a >= b.
  friend mask4x2 operator>=(const V& a, const V& b) { return {a.low >= b.low, a.high >= b.high}; }
  /// Returns where a < b.
  friend mask4x2 operator<(const V& a, double b) { return {a.low < b, a.high < b}; }
  /// Returns where a > b.
  friend mask4x2 operator>(const V& a, double b) { return {a.low > b, a.high > b}; }
  /// Returns where a <= b.
  friend mask4x2 operator<=(const V& a, double b) { return {a.low <= b, a.high <= b}; }
  /// Returns where a >= b.
  friend mask4x2 operator>=(const V& a, double b) { return {a.low >= b, a.high >= b}; }
};

/// Returns the square root in each lane, correctly rounded.
inline double4x2 sqrt_of(const double4x2& x) { return {sqrt_of(x.low), sqrt_of(x.high)}; }
/// Returns `a` in the lanes where `condition` holds and `b` in the others.
inline double4x2 select(const mask4x2& condition, const double4x2& a, const double4x2& b) {
  return {select(condition.low, a.low, b.low), select(condition.high, a.high, b.high)};
}
/// Returns a bit for each lane in which the mask is set: bit i for lane i.
inline unsigned lanes_of(const mask4x2& mask) { return lanes_of(mask.low) | lanes_of(mask.high) << 4; }

/// The first, second and third entries of four rows.
struct FirstThree {
  double4 x,  ///< First entries.
      y,      ///< Second entries.
      z;      ///< Third entries.
};
/// Returns the first three entries of the rows `a`, `b`, `c` and `d` by coordinate. The fourth entries are
/// ignored.
inline FirstThree load_four(const double4& a, const double4& b, const double4& c, const double4& d) {
  const double4 even_ab = __builtin_shufflevector(a, b, 0, 4, 2, 6),
                odd_ab = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const double4 even_cd = __builtin_shufflevector(c, d, 0, 4, 2, 6),
                odd_cd = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  return {__builtin_shufflevector(even_ab, even_cd, 0, 1, 4, 5),
          __builtin_shufflevector(odd_ab, odd_cd, 0, 1, 4, 5),
          __builtin_shufflevector(even_ab, even_cd, 2, 3, 6, 7)};
}
/// Writes the four rows (x[i], y[i], z[i], w[i]) to out[0], ..., out[3].
inline void store_four(const double4& x, const double4& y, const double4& z, const double4& w, double4* out) {
  const double4 even_xy = __builtin_shufflevector(x, y, 0, 4, 2, 6),
                odd_xy = __builtin_shufflevector(x, y, 1, 5, 3, 7);
  const double4 even_zw = __builtin_shufflevector(z, w, 0, 4, 2, 6),
                odd_zw = __builtin_shufflevector(z, w, 1, 5, 3, 7);
  out[0] = __builtin_shufflevector(even_xy, even_zw, 0, 1, 4, 5);
  out[1] = __builtin_shufflevector(odd_xy, odd_zw, 0, 1, 4, 5);
  out[2] = __builtin_shufflevector(even_xy, even_zw, 2, 3, 6, 7);
  out[3] = __builtin_shufflevector(odd_xy, odd_zw, 2, 3, 6, 7);
}

}  // namespace duet
