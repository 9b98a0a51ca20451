// Scalar products whose sums come in the order of the coordinates, for what has to have the bits of packs:
// Eigen's order depends on its version.
#pragma once

#include "sim/base/types.h"

namespace duet {

inline double dot_in_order(const Vec3& a, const Vec3& b) {
  return (a.x() * b.x() + a.y() * b.y()) + a.z() * b.z();
}
inline double square_in_order(const Vec3& a) { return dot_in_order(a, a); }

}  // namespace duet
