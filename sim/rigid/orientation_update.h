// How the orientation of a rigid body is advanced over a step in which its angular momentum is constant
// (paper section 4.1).
#pragma once

#include "sim/base/types.h"

namespace duet {

/// The rule by which a dynamic body turns in a step dt with constant angular momentum L.
enum class OrientationUpdate {
  /// q' = exp(dt w) q.
  first_order,
  /// q' = exp(dt w + dt^2/2 I^-1 (L x w)) q (paper section 4.1).
  second_order,
  /// The motion of the free body to rounding: energy and angular momentum are both kept; see free_rotation().
  exact
};

/// Returns the rotation of a free body over `dt`, from its start to its end, in world axes:
///
///     m' = m x (J m),   q' = q (J m) / 2,   m = Q^T L,
///
/// where q is the unit quaternion of the rotation Q since the start, and J the inverse inertia tensor at the
/// start. These are Euler's equations of the free body.
///
/// `L` (kg m^2/s) is the constant angular momentum and `inverse_inertia` (1/(kg m^2)) is J, both in world
/// axes; `dt` is in s. Both right sides are quadratic, so that the coefficients of the Taylor series follow
/// from each other by sums of products. The step is cut into pieces of at most a tenth of a radian, which
/// need about 15 terms for double precision. If that takes more than 64 pieces, about a turn in `dt`, the
/// body turns at the rate that it starts with instead.
Quat free_rotation(const Mat3& inverse_inertia, const Vec3& L, double dt);

}  // namespace duet
