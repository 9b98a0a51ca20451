// Eight triangles at once, for their distances from a point.
#pragma once

#include <array>

#include "sim/base/simd.h"
#include "sim/base/types.h"

namespace duet {

class TrianglePack {
 public:
  void set(std::size_t lane, const Vec3& a, const Vec3& b, const Vec3& c);
  // m^2, from x to nearest_point() of each: the same bits as what it gives.
  Pack squared_distances(const Vec3& x) const;

 private:
  Vec3 corner(std::size_t k, std::size_t lane) const;

  std::array<PackVector, 3> corner_;  // m
  unsigned degenerate_ = 0;           // a bit for each that is an edge or a point
};

}  // namespace duet
