// Eigen aliases and poses, which every module uses.
#pragma once

#include <cmath>
#include <cstdint>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "sim/base/assert.h"
#include "sim/base/eigen_order.h"
#include "sim/base/index.h"

namespace duet {

/// A vector of two doubles.
using Vec2 = Eigen::Vector2d;
/// A vector of three doubles.
using Vec3 = Eigen::Vector3d;
/// A vector of six doubles, such as a twist (v, w).
using Vec6 = Eigen::Matrix<double, 6, 1>;
/// A 3x3 matrix of doubles.
using Mat3 = Eigen::Matrix3d;
/// A 6x6 matrix of doubles.
using Mat6 = Eigen::Matrix<double, 6, 6>;
/// A quaternion of doubles.
using Quat = Eigen::Quaterniond;
/// A vector of two floats, for drawing.
using Vec2f = Eigen::Vector2f;
/// A vector of three floats, for drawing.
using Vec3f = Eigen::Vector3f;
/// A vector of three integers.
using Vec3i = Eigen::Vector3i;

/// Returns whether a vector or a quaternion has length 1, to 5e-7: what assertions ask of directions and
/// orientations. Rounding leaves 1e-15, and unit vectors of floats 1e-7. Values that are not finite pass:
/// they are failures of a simulation, which its stages report, not faults of the program.
template <class Direction>
bool is_unit(const Direction& direction) {
  const double excess = static_cast<double>(direction.squaredNorm()) - 1;
  return std::abs(excess) < 1e-6 || !std::isfinite(excess);
}

/// A rigid placement: x_world = orientation * x_body + position.
struct Pose {
  Vec3 position = Vec3::Zero();         ///< Origin of the body frame in the world, m.
  Quat orientation = Quat::Identity();  ///< Unit quaternion, body to world.
  /// Returns the world position (m) of the point `x` in the body frame (m).
  Vec3 to_world(const Vec3& x) const {
    DUET_ASSERT(is_unit(orientation));
    return orientation * x + position;
  }
  /// Returns the position in the body frame (m) of the world point `x` (m).
  Vec3 to_body(const Vec3& x) const {
    DUET_ASSERT(is_unit(orientation));
    return orientation.conjugate() * (x - position);
  }
};

/// Returns the cross-product matrix: skew(a) b = a x b (a^* in the paper).
inline Mat3 skew(const Vec3& a) {
  Mat3 m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

}  // namespace duet
