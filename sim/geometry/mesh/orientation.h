// On which side of a line or plane a point lies, decided exactly.
#pragma once

#include "sim/base/types.h"

namespace duet {

// Sign of (b - a) x (c - a) . (d - a): 1 where d lies on the side of the triangle abc from which abc turn
// counter-clockwise, -1 on the other, 0 exactly on its plane. The sign is that of the given doubles, without
// rounding (Shewchuk 1997: a filter, then expansions), for coordinates between 1e-70 and 1e70 in magnitude,
// or 0.
int orientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d);

// The same in the plane: 1 where abc turn counter-clockwise.
int orientation(const Vec2& a, const Vec2& b, const Vec2& c);

}  // namespace duet
