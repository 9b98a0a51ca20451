// Eight doubles at once. A compiler vector type: it becomes AVX-512, AVX or SSE instructions, or scalar code,
// as the target has them, with the same results everywhere (every operation is a correctly rounded IEEE one).
#pragma once

#include <cmath>
#include <cstddef>

namespace duet {

inline constexpr std::size_t pack_width = 8;
using Pack = double __attribute__((vector_size(8 * pack_width)));
using PackMask = long long __attribute__((vector_size(8 * pack_width)));

// The generic formulas below are written once for T = double and T = Pack.
inline double select(bool condition, double a, double b) { return condition ? a : b; }
inline Pack select(const PackMask& condition, const Pack& a, const Pack& b) { return condition ? a : b; }
inline double log_of(double x) { return std::log(x); }
inline Pack log_of(const Pack& x) {
  Pack result{};
  for (std::size_t i = 0; i < pack_width; ++i) result[i] = std::log(x[i]);
  return result;
}
inline double sqrt_of(double x) { return std::sqrt(x); }
inline Pack sqrt_of(const Pack& x) {
  Pack result{};
  for (std::size_t i = 0; i < pack_width; ++i) result[i] = std::sqrt(x[i]);
  return result;
}

// 3x3 matrix of T, row-major; enough algebra for finite elements.
template <class T>
struct Matrix3 {
  T m[3][3];
  T* operator[](int row) { return m[row]; }
  const T* operator[](int row) const { return m[row]; }
};

template <class T>
Matrix3<T> operator*(const Matrix3<T>& a, const Matrix3<T>& b) {
  Matrix3<T> c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
  return c;
}

// a * b^T
template <class T>
Matrix3<T> times_transposed(const Matrix3<T>& a, const Matrix3<T>& b) {
  Matrix3<T> c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[i][j] = a[i][0] * b[j][0] + a[i][1] * b[j][1] + a[i][2] * b[j][2];
  return c;
}

// a^T * b
template <class T>
Matrix3<T> transposed_times(const Matrix3<T>& a, const Matrix3<T>& b) {
  Matrix3<T> c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[i][j] = a[0][i] * b[0][j] + a[1][i] * b[1][j] + a[2][i] * b[2][j];
  return c;
}

template <class T>
Matrix3<T> cofactor(const Matrix3<T>& a) {
  Matrix3<T> c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      c[i][j] = a[i1][j1] * a[i2][j2] - a[i1][j2] * a[i2][j1];
    }
  return c;
}

// det a, given its cofactor matrix.
template <class T>
T determinant(const Matrix3<T>& a, const Matrix3<T>& cof) {
  return a[0][0] * cof[0][0] + a[0][1] * cof[0][1] + a[0][2] * cof[0][2];
}

template <class T>
T squared_norm(const Matrix3<T>& a) {
  T sum = a[0][0] * a[0][0];
  for (int k = 1; k < 9; ++k) sum = sum + a[k / 3][k % 3] * a[k / 3][k % 3];
  return sum;
}

}  // namespace duet
