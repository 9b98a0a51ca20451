// Rotations as vectors, the axis times the angle in radians, and between directions.
#pragma once

#include <cmath>

#include "sim/base/types.h"

namespace duet {

// The unit quaternion that rotates by |v| about v.
inline Quat exponential(const Vec3& v) {
  const double angle = v.norm();
  // sin(a/2)/a, by its series where the quotient would lose digits
  const double factor = angle < 1e-4 ? 0.5 - angle * angle / 48 : std::sin(angle / 2) / angle;
  return Quat(std::cos(angle / 2), factor * v.x(), factor * v.y(), factor * v.z());
}

// The shortest rotation vector of a unit quaternion: exponential(logarithm(q)) = +-q, length at most pi.
inline Vec3 logarithm(const Quat& q) {
  const Vec3 v = q.w() < 0 ? Vec3(-q.vec()) : Vec3(q.vec());
  const double sine = v.norm();
  return sine > 0 ? Vec3(2 * std::atan2(sine, std::abs(q.w())) / sine * v) : Vec3(2 * v);
}

// The unit quaternion that turns the direction of `from` to that of `to` the shortest way, about any axis
// across if they are opposite. Apart from its callers: of opposite directions Eigen asks a singular value
// decomposition, whose templates took the compiler as long as all the rest of a file.
Quat shortest_turn(const Vec3& from, const Vec3& to);

}  // namespace duet
