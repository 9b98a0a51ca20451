// Scalar products whose sums run in the order of the coordinates. Code whose results must match those of
// packs (see simd.h) bit for bit uses them, because Eigen's order depends on its version.
#pragma once

#include "sim/base/types.h"

namespace duet {

/// Returns a . b, summed as (x + y) + z.
inline double dot_in_order(const Vec3& a, const Vec3& b) {
  return (a.x() * b.x() + a.y() * b.y()) + a.z() * b.z();
}
/// Returns |a|^2, summed as (x + y) + z.
inline double square_in_order(const Vec3& a) { return dot_in_order(a, a); }

}  // namespace duet
