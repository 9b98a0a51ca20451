// Eight vectors at once, gathered from particles.
#pragma once

#include <array>
#include <vector>

#include "sim/base/simd.h"
#include "sim/base/types.h"

namespace duet {

inline PackVector operator+(const PackVector& a, const PackVector& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class P>
VectorOf<P> operator-(const VectorOf<P>& a, const VectorOf<P>& b) {
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
  return load_rows([&](std::size_t lane) {
    const double* row = values[static_cast<std::size_t>(index[lane])].data();
    return Quad{row[0], row[1], row[2], 0};
  });
}

inline double sum_of_lanes(const Pack& x) {
  double sum = 0;
  for (std::size_t lane = 0; lane < pack_width; ++lane) sum += x[lane];
  return sum;
}

}  // namespace duet
