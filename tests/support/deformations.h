// Deformation gradients, to test materials with.
#pragma once

#include <random>
#include <vector>

#include "sim/base/matrix3.h"
#include "sim/base/types.h"

namespace duet::test {

// Converts an Eigen matrix.
inline Matrix3<double> matrix_of(const Mat3& m) {
  Matrix3<double> result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) result[i][j] = m(i, j);
  return result;
}
// Converts to an Eigen matrix.
inline Mat3 eigen_of(const Matrix3<double>& m) {
  Mat3 result;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) result(i, j) = m[i][j];
  return result;
}

// Returns a matrix with entries from -`size` to `size`.
inline Mat3 random_matrix(std::mt19937& random, double size = 1) {
  std::uniform_real_distribution<double> uniform(-size, size);
  Mat3 m;
  for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = uniform(random);
  return m;
}

// Returns 32 random deformation gradients: near rest, stretched, sheared, compressed, flat and inverted.
// Their number is a multiple of eight, for code that works on packs of eight.
inline std::vector<Mat3> deformations() {
  std::mt19937 random(7);
  std::vector<Mat3> result;
  for (const double depth : {1.0, 0.5, 0.26, 0.2, 0.0, -0.5, -1.0, 2.0})
    for (int i = 0; i < 4; ++i) {
      const Mat3 F = Vec3(1.1, 0.95, depth).asDiagonal();
      result.push_back(F + random_matrix(random, depth == 1.0 ? 0.3 : 0.09));
    }
  return result;
}

}  // namespace duet::test
