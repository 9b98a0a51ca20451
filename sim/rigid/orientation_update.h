/// How the orientation of a rigid body is advanced over a step whose angular momentum L is fixed.
#pragma once

#include "sim/base/types.h"

namespace duet {

/// first_order:  q' = exp(dt w) q.
/// second_order: q' = exp(dt w + dt^2/2 I^-1 (L x w)) q, the paper's section 4.1.
/// exact:        the motion of the free body, to rounding: energy and angular momentum are both kept.
enum class OrientationUpdate { first_order, second_order, exact };

/// The rotation of a free body over `dt` (s) that has the constant angular momentum `L` (kg m^2/s) and, at
/// the start, the inverse inertia tensor `inverse_inertia` (1/(kg m^2)), both in world axes.
///
/// With m = Q^T L for the rotation Q since the start, Euler's equations are m' = m x (J m), and the unit
/// quaternion of Q obeys q' = q (J m) / 2. Both right sides are quadratic, so the coefficients of the Taylor
/// series follow from each other by sums of products; pieces of at most a tenth of a radian need about 15 for
/// double precision. A piece beyond 64 of them, more than a turn in `dt`, is taken at the rate it starts
/// with.
Quat free_rotation(const Mat3& inverse_inertia, const Vec3& L, double dt);

}  // namespace duet
