// Rotations as vectors, the axis times the angle in radians, and between directions.
#pragma once

#include <cmath>

#include "sim/base/elementary.h"
#include "sim/base/types.h"

namespace duet {

// The unit quaternion that rotates by |v| about v.
inline Quat exponential(const Vec3& v) {
  const double angle = v.norm();
  const math::SineCosine half = math::sine_cosine(angle / 2);
  // sin(a/2)/a, by its series where the quotient would lose digits
  const double factor = angle < 1e-4 ? 0.5 - angle * angle / 48 : half.sine / angle;
  return Quat(half.cosine, factor * v.x(), factor * v.y(), factor * v.z());
}

// The shortest rotation vector of a unit quaternion: exponential(logarithm(q)) = +-q, length at most pi.
inline Vec3 logarithm(const Quat& q) {
  const Vec3 v = q.w() < 0 ? Vec3(-q.vec()) : Vec3(q.vec());
  const double sine = v.norm();
  return sine > 0 ? Vec3(2 * math::atan2(sine, std::abs(q.w())) / sine * v) : Vec3(2 * v);
}

// The unit quaternion that turns the direction of `from` to that of `to` the shortest way, about an axis
// across if they are opposite.
Quat shortest_turn(const Vec3& from, const Vec3& to);

}  // namespace duet
