#include "sim/coupling/end_of_wall.h"

#include <cmath>

namespace duet {

bool is_at_end_of_wall(const LevelSet& shape, const Vec3& foot, const Vec3& normal, const Vec3& way) {
  constexpr double on = 0.1, off = 0.5;  // of a step: by how much the surface goes on or does not
  const Vec3 along = way - way.dot(normal) * normal;
  const double length = along.norm();
  if (!(length > 0)) return false;
  const double step = level_height * way.norm();
  const Vec3 shift = step / length * along;
  return std::abs(shape.distance(foot - shift)) < on * step && shape.distance(foot + shift) > off * step;
}

}  // namespace duet
