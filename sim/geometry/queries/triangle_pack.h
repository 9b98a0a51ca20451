// Eight triangles at once, for their distances from a point.
#pragma once

#include <array>

#include "sim/base/simd.h"
#include "sim/base/types.h"

namespace duet {

/// Eight triangles, stored by coordinate.
class TrianglePack {
 public:
  /// Sets the corners (m) of the triangle in a lane. Each lane may be set once.
  void set(std::size_t lane, const Vec3& a, const Vec3& b, const Vec3& c);
  /// Returns the squared distances (m^2) from `x` to nearest_point() of each triangle, with the same bits as
  /// that function gives.
  double8 squared_distances(const Vec3& x) const;

 private:
  // Returns corner `k` of the triangle in a lane, m.
  Vec3 corner(std::size_t k, std::size_t lane) const;

  std::array<vector8, 3> corner_;  // m
  unsigned degenerate_ = 0;        // a bit for each lane whose triangle is an edge or a point
};

}  // namespace duet
