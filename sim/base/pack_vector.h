// Eight vectors at once, gathered from particles and scattered to them.
#pragma once

#include <array>
#include <vector>

#include "sim/base/simd.h"
#include "sim/base/types.h"

namespace duet {

struct PackVector {
  Pack x{}, y{}, z{};
};

inline PackVector operator+(const PackVector& a, const PackVector& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline PackVector operator-(const PackVector& a, const PackVector& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline PackVector operator*(const Pack& s, const PackVector& a) { return {s * a.x, s * a.y, s * a.z}; }
inline Pack dot(const PackVector& a, const PackVector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline PackVector cross(const PackVector& a, const PackVector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline PackVector select(const PackMask& condition, const PackVector& a, const PackVector& b) {
  return {select(condition, a.x, b.x), select(condition, a.y, b.y), select(condition, a.z, b.z)};
}

using PackIndex = std::array<int, pack_width>;  // of a particle in each lane

inline PackVector gather(const std::vector<Vec3>& values, const PackIndex& index) {
  PackVector result;
  for (std::size_t lane = 0; lane < pack_width; ++lane) {
    const Vec3& value = values[static_cast<std::size_t>(index[lane])];
    result.x[lane] = value.x();
    result.y[lane] = value.y();
    result.z[lane] = value.z();
  }
  return result;
}

// Lane l goes to out[l * stride].
inline void scatter(const PackVector& v, Vec3* out, std::size_t stride) {
  for (std::size_t lane = 0; lane < pack_width; ++lane)
    out[lane * stride] = {v.x[lane], v.y[lane], v.z[lane]};
}

inline double sum_of_lanes(const Pack& x) {
  double sum = 0;
  for (std::size_t lane = 0; lane < pack_width; ++lane) sum += x[lane];
  return sum;
}

}  // namespace duet
