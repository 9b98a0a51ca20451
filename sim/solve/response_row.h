// A contact, a pair of surfaces or a drive of a joint as a velocity solve sees it: its impulse decreases with
// its relative velocity.
#pragma once

#include <array>

#include "sim/base/assert.h"
#include "sim/base/types.h"

namespace duet {

/// The derivative of the impulse of one row of a velocity solve.
///
/// Its relative velocity is u = sum A_k v_k over parts of the velocity. Its impulse on part k decreases by
/// A_k^T G u, so that the matrix of the solve has the blocks A_j^T G A_k.
struct ResponseRow {
  /// What the velocity of a part belongs to.
  enum class Of {
    particle,  ///< a particle
    linear,    ///< the center of mass of a rigid body
    angular    ///< the rotation of a rigid body
  };
  /// A part of the velocity.
  struct Part {
    Of of = Of::particle;     ///< its kind
    int index = 0;            ///< particle or rigid body
    Mat3 map = Mat3::Zero();  ///< A_k, without unit, or in m for rotations
  };
  /// Largest number of parts: two rigid bodies, or a rigid body and four particles.
  static constexpr std::size_t max_parts = 6;

  std::array<Part, max_parts> part;  ///< the first `count` are in use
  std::size_t count = 0;             ///< number of parts
  Mat3 slope = Mat3::Zero();         ///< G, kg

  /// Adds a part.
  void add(Of of, int index, const Mat3& map) {
    DUET_ASSERT(count < max_parts);
    part[count++] = {of, index, map};
  }
  /// Adds `sign` times the velocity v + w x arm of a point of a rigid body, with the `arm` (m) from its
  /// center of mass.
  void add_point(int body, const Vec3& arm, double sign) {
    add(Of::linear, body, sign * Mat3::Identity());
    add(Of::angular, body, -sign * skew(arm));
  }
};

}  // namespace duet
