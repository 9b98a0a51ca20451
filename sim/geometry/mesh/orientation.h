// Exact predicates, which tell on which side of a line or plane a point lies.
#pragma once

#include "sim/base/types.h"

namespace duet {

/// Returns the sign of (b - a) x (c - a) . (d - a), exactly. It is 1 if `d` lies on the side of the triangle
/// abc from which abc turn counter-clockwise, -1 if on the other side, and 0 if exactly in its plane. The
/// sign is that of the given doubles, without rounding (Shewchuk 1997, "Adaptive precision floating-point
/// arithmetic and fast robust geometric predicates": a filter, then expansions). Coordinates must be 0 or
/// between 1e-70 and 1e70 in magnitude.
int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

/// Returns the sign of the area of the triangle abc in the plane, exactly: 1 if abc turn counter-clockwise,
/// -1 if clockwise, 0 if they lie on a line. Coordinates must be 0 or between 1e-70 and 1e70 in magnitude.
int orientation(const Vec2& a, const Vec2& b, const Vec2& c);

}  // namespace duet
