// Eight doubles as two vectors of four, for machines whose vectors have no more: those of a wider compiler
// vector type go through memory between operations (with AVX2 elastic forces took 1.5 to 1.75 times as long).
#pragma once

#include <cmath>
#include <cstddef>

#if defined(__AVX__)
#include <immintrin.h>
#endif

namespace duet {

// Rows of four doubles or floats, as records lie in memory.
using Quad = double __attribute__((vector_size(32)));
using QuadF = float __attribute__((vector_size(16)));
using QuadMask = decltype(Quad{} < Quad{});  // four 64-bit integers: all bits where it holds, else none

inline Quad sqrt_of(const Quad& x) {
#if defined(__AVX__)
  return _mm256_sqrt_pd(x);
#else
  return Quad{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
#endif
}
inline Quad select(const QuadMask& condition, const Quad& a, const Quad& b) { return condition ? a : b; }
inline unsigned lanes_of(const QuadMask& mask) {  // a bit for each lane where it holds
#if defined(__AVX__)
  return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<__m256d>(mask)));
#else
  unsigned bits = 0;
  for (unsigned lane = 0; lane < 4; ++lane) bits |= mask[lane] != 0 ? 1u << lane : 0u;
  return bits;
#endif
}

struct TwoMasks {
  QuadMask low, high;
  friend TwoMasks operator&(const TwoMasks& a, const TwoMasks& b) { return {a.low & b.low, a.high & b.high}; }
};

// Has the operators of a compiler vector type, as far as the program uses them.
struct alignas(64) TwoQuads {
  Quad low, high;

  // A vector type shares the aliasing of its elements.
  double& operator[](std::size_t lane) { return reinterpret_cast<double*>(&low)[lane]; }
  double operator[](std::size_t lane) const { return lane < 4 ? low[lane] : high[lane - 4]; }

  using V = TwoQuads;
  friend V operator-(const V& a) { return {-a.low, -a.high}; }
  friend V operator+(const V& a, const V& b) { return {a.low + b.low, a.high + b.high}; }
  friend V operator-(const V& a, const V& b) { return {a.low - b.low, a.high - b.high}; }
  friend V operator*(const V& a, const V& b) { return {a.low * b.low, a.high * b.high}; }
  friend V operator/(const V& a, const V& b) { return {a.low / b.low, a.high / b.high}; }
  friend V operator+(const V& a, double b) { return {a.low + b, a.high + b}; }
  friend V operator-(const V& a, double b) { return {a.low - b, a.high - b}; }
  friend V operator*(const V& a, double b) { return {a.low * b, a.high * b}; }
  friend V operator/(const V& a, double b) { return {a.low / b, a.high / b}; }
  friend V operator+(double a, const V& b) { return {a + b.low, a + b.high}; }
  friend V operator-(double a, const V& b) { return {a - b.low, a - b.high}; }
  friend V operator*(double a, const V& b) { return {a * b.low, a * b.high}; }
  friend V operator/(double a, const V& b) { return {a / b.low, a / b.high}; }
  template <class T>
  V& operator+=(const T& b) {
    return *this = *this + b;
  }
  template <class T>
  V& operator*=(const T& b) {
    return *this = *this * b;
  }

  friend TwoMasks operator<(const V& a, const V& b) { return {a.low < b.low, a.high < b.high}; }
  friend TwoMasks operator>(const V& a, const V& b) { return {a.low > b.low, a.high > b.high}; }
  friend TwoMasks operator<=(const V& a, const V& b) { return {a.low <= b.low, a.high <= b.high}; }
  friend TwoMasks operator>=(const V& a, const V& b) { return {a.low >= b.low, a.high >= b.high}; }
  friend TwoMasks operator<(const V& a, double b) { return {a.low < b, a.high < b}; }
  friend TwoMasks operator>(const V& a, double b) { return {a.low > b, a.high > b}; }
  friend TwoMasks operator<=(const V& a, double b) { return {a.low <= b, a.high <= b}; }
  friend TwoMasks operator>=(const V& a, double b) { return {a.low >= b, a.high >= b}; }
};

inline TwoQuads sqrt_of(const TwoQuads& x) { return {sqrt_of(x.low), sqrt_of(x.high)}; }
inline TwoQuads select(const TwoMasks& condition, const TwoQuads& a, const TwoQuads& b) {
  return {select(condition.low, a.low, b.low), select(condition.high, a.high, b.high)};
}
inline unsigned lanes_of(const TwoMasks& mask) { return lanes_of(mask.low) | lanes_of(mask.high) << 4; }

// Of four rows, the vectors of their first, second and third members.
struct FirstThree {
  Quad x, y, z;
};
inline FirstThree load_four(const Quad& a, const Quad& b, const Quad& c, const Quad& d) {
  const Quad even_ab = __builtin_shufflevector(a, b, 0, 4, 2, 6),
             odd_ab = __builtin_shufflevector(a, b, 1, 5, 3, 7);
  const Quad even_cd = __builtin_shufflevector(c, d, 0, 4, 2, 6),
             odd_cd = __builtin_shufflevector(c, d, 1, 5, 3, 7);
  return {__builtin_shufflevector(even_ab, even_cd, 0, 1, 4, 5),
          __builtin_shufflevector(odd_ab, odd_cd, 0, 1, 4, 5),
          __builtin_shufflevector(even_ab, even_cd, 2, 3, 6, 7)};
}
// The opposite: four rows (x, y, z, w).
inline void store_four(const Quad& x, const Quad& y, const Quad& z, const Quad& w, Quad* out) {
  const Quad even_xy = __builtin_shufflevector(x, y, 0, 4, 2, 6),
             odd_xy = __builtin_shufflevector(x, y, 1, 5, 3, 7);
  const Quad even_zw = __builtin_shufflevector(z, w, 0, 4, 2, 6),
             odd_zw = __builtin_shufflevector(z, w, 1, 5, 3, 7);
  out[0] = __builtin_shufflevector(even_xy, even_zw, 0, 1, 4, 5);
  out[1] = __builtin_shufflevector(odd_xy, odd_zw, 0, 1, 4, 5);
  out[2] = __builtin_shufflevector(even_xy, even_zw, 2, 3, 6, 7);
  out[3] = __builtin_shufflevector(odd_xy, odd_zw, 2, 3, 6, 7);
}

}  // namespace duet
