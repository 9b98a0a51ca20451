// 3x3 matrices of doubles or packs, with the algebra that finite elements need. Sums run in a fixed order, so
// that every lane of a pack gets the bits of the scalar computation.
#pragma once

#include "sim/base/simd.h"

namespace duet {

/// A 3x3 matrix in row-major order. `T` is double, double8 or float8.
template <class T>
struct Matrix3 {
  /// Entries: m[row][column].
  T m[3][3];
  /// Returns a pointer to the three entries of `row`.
  T* operator[](int row) { return m[row]; }
  /// Returns a pointer to the three entries of `row`.
  const T* operator[](int row) const { return m[row]; }
};

/// Returns the product a b.
template <class T>
Matrix3<T> operator*(const Matrix3<T>& a, const Matrix3<T>& b) {
  Matrix3<T> c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
  return c;
}

/// Returns the sum a + b.
template <class T>
Matrix3<T> operator+(const Matrix3<T>& a, const Matrix3<T>& b) {
  Matrix3<T> c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[i][j] = a[i][j] + b[i][j];
  return c;
}

/// Returns `a` times a scalar.
template <class T>
Matrix3<T> operator*(const T& scale, const Matrix3<T>& a) {
  Matrix3<T> c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[i][j] = scale * a[i][j];
  return c;
}

/// Returns a b^T.
template <class T>
Matrix3<T> times_transposed(const Matrix3<T>& a, const Matrix3<T>& b) {
  Matrix3<T> c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[i][j] = a[i][0] * b[j][0] + a[i][1] * b[j][1] + a[i][2] * b[j][2];
  return c;
}

/// Returns a^T b.
template <class T>
Matrix3<T> transposed_times(const Matrix3<T>& a, const Matrix3<T>& b) {
  Matrix3<T> c;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) c[i][j] = a[0][i] * b[0][j] + a[1][i] * b[1][j] + a[2][i] * b[2][j];
  return c;
}

/// Returns the cofactor matrix, which is det(a) a^-T for a regular matrix.
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

/// Returns the determinant of `a`, given its cofactor matrix `cof`.
template <class T>
T determinant(const Matrix3<T>& a, const Matrix3<T>& cof) {
  return a[0][0] * cof[0][0] + a[0][1] * cof[0][1] + a[0][2] * cof[0][2];
}

/// Rounds the entries to single precision.
inline Matrix3<float8> to_single(const Matrix3<double8>& a) {
  Matrix3<float8> b;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) b[i][j] = to_single(a[i][j]);
  return b;
}

/// Converts the entries to double precision, exactly.
inline Matrix3<double8> to_double(const Matrix3<float8>& a) {
  Matrix3<double8> b;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) b[i][j] = to_double(a[i][j]);
  return b;
}

/// Returns the double contraction a : b, the sum of the products of corresponding entries.
template <class T>
T contraction(const Matrix3<T>& a, const Matrix3<T>& b) {
  T sum = a[0][0] * b[0][0];
  for (int k = 1; k < 9; ++k) sum = sum + a[k / 3][k % 3] * b[k / 3][k % 3];
  return sum;
}

/// Returns the squared Frobenius norm a : a.
template <class T>
T squared_norm(const Matrix3<T>& a) {
  return contraction(a, a);
}

}  // namespace duet
