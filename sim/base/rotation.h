// Conversions between unit quaternions and rotation vectors (the axis times the angle in radians), and the
// rotation between two directions.
#pragma once

#include <cmath>

#include "sim/base/assert.h"
#include "sim/base/elementary.h"
#include "sim/base/types.h"

namespace duet {

/// Returns the unit quaternion that rotates by the angle |v| (rad) about the axis `v`.
inline Quat exponential(const Vec3& v) {
  const double angle = v.norm();
  const math::SineCosine half = math::sine_cosine(angle / 2);
  // sin(a/2)/a; below 1e-4 rad by its series, whose next term is below 1e-19.
  const double factor = angle < 1e-4 ? 0.5 - angle * angle / 48 : half.sine / angle;
  return Quat(half.cosine, factor * v.x(), factor * v.y(), factor * v.z());
}

/// Returns the shortest rotation vector (rad) of a unit quaternion: exponential(logarithm(q)) = q or -q. Its
/// length is at most pi.
inline Vec3 logarithm(const Quat& q) {
  DUET_ASSERT(is_unit(q));
  const Vec3 v = q.w() < 0 ? Vec3(-q.vec()) : Vec3(q.vec());
  const double sine = v.norm();
  return sine > 0 ? Vec3(2 * math::atan2(sine, std::abs(q.w())) / sine * v) : Vec3(2 * v);
}

/// Returns the unit quaternion of the smallest rotation that takes the direction of `from` to that of `to`.
/// Opposite directions are turned by pi about some axis perpendicular to them. Neither vector may be zero.
Quat shortest_rotation(const Vec3& from, const Vec3& to);

}  // namespace duet
