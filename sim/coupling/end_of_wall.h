// What lies level with the end of a wall is no obstacle to the wall: it slides over it.
#pragma once

#include "sim/geometry/level_set.h"

namespace duet {

/// What is no farther below the end of a wall than this part of a point's way into its body is at its height.
constexpr double level_height = 2e-4;

/// Whether `foot` (m, body space) on a wall of the shape, whose unit normal is `normal`, is at the wall's
/// end, and a body to the side `way` of it (m) beyond that end: the body slides over it, as over the side of
/// a rail that it lies on.
bool is_at_end_of_wall(const LevelSet& shape, const Vec3& foot, const Vec3& normal, const Vec3& way);

}  // namespace duet
