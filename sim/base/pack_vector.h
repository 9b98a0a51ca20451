// Algebra of eight 3-vectors at once, and their gathering from arrays of particles.
#pragma once

#include <array>
#include <vector>

#include "sim/base/simd.h"
#include "sim/base/types.h"

namespace duet {

/// Returns a + b in each lane.
inline vector8 operator+(const vector8& a, const vector8& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
/// Returns a - b in each lane. `P` is double8 or float8.
template <class P>
VectorOf<P> operator-(const VectorOf<P>& a, const VectorOf<P>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
/// Returns s a in each lane.
inline vector8 operator*(const double8& s, const vector8& a) { return {s * a.x, s * a.y, s * a.z}; }
/// Returns a . b in each lane.
inline double8 dot(const vector8& a, const vector8& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
/// Returns a x b in each lane.
inline vector8 cross(const vector8& a, const vector8& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
/// Returns `a` in the lanes where `condition` holds and `b` in the others.
inline vector8 select(const mask8& condition, const vector8& a, const vector8& b) {
  return {select(condition, a.x, b.x), select(condition, a.y, b.y), select(condition, a.z, b.z)};
}

/// The index of a particle for each lane.
using PackIndex = std::array<int, pack_width>;

/// Returns the vectors values[index[lane]]. Every index must be valid.
inline vector8 gather(const std::vector<Vec3>& values, const PackIndex& index) {
  return load_rows([&](std::size_t lane) {
    const double* row = values[static_cast<std::size_t>(index[lane])].data();
    return double4{row[0], row[1], row[2], 0};
  });
}

/// Returns the sum of all lanes, in their order.
inline double sum_of_lanes(const double8& x) {
  double sum = 0;
  for (std::size_t lane = 0; lane < pack_width; ++lane) sum += x[lane];
  return sum;
}

}  // namespace duet
