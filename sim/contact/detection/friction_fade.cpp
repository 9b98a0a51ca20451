#include "sim/contact/detection/friction_fade.h"

#include <algorithm>

namespace duet {
namespace {

// Sines of the angles between mesh and surface at which friction begins to fade, 30 degrees, and at which it
// is gone, 44 degrees. Greater angles let elements hang on edges; smaller ones let bodies slide that lie at a
// slant.
constexpr double lies = 0.5, crosses = 0.7;

}  // namespace

Vec3 inward_direction(const Bodies& bodies, const SurfacePoint& point) {
  Vec3 sum = Vec3::Zero();
  if (bodies.neighbors.first.empty()) return sum;
  const std::vector<Vec3>& x = bodies.particles.x;
  for (std::size_t i = 0; i < as_index(point.count); ++i)
    for (const int other : bodies.neighbors.of(point.particle[i]))
      sum += point.weight[i] * (x[as_index(other)] - x[as_index(point.particle[i])]);
  return sum.normalized();
}

double friction_fade_fraction(const Bodies& bodies, const SurfacePoint& point, const Vec3& normal) {
  const std::vector<Vec3>& x = bodies.particles.x;
  const Vec3& first = x[as_index(point.particle[0])];
  const auto edge = [&](std::size_t i) { return Vec3(x[as_index(point.particle[i])] - first); };
  double across = 0;  // sine of the angle between surface and mesh
  if (point.count == 1) {
    across = -inward_direction(bodies, point).dot(normal);
  } else if (point.count == 2) {
    across = std::abs(edge(1).normalized().dot(normal));
  } else if (point.count == 3) {
    across = edge(1).cross(edge(2)).normalized().cross(normal).norm();
  }
  return std::clamp((crosses - across) / (crosses - lies), 0.0, 1.0);
}

ElementLists neighbors(std::size_t particles, const std::vector<Tet>& tets) {
  const ElementLists around = elements_around(particles, tets);
  ElementLists lists;
  lists.first.push_back(0);
  std::vector<int> here;
  for (std::size_t p = 0; p < particles; ++p) {
    here.clear();
    for (const int tet : around.of(static_cast<int>(p)))
      for (const int other : tets[as_index(tet)])
        if (other != static_cast<int>(p)) here.push_back(other);
    std::sort(here.begin(), here.end());
    here.erase(std::unique(here.begin(), here.end()), here.end());
    lists.items.insert(lists.items.end(), here.begin(), here.end());
    lists.first.push_back(static_cast<int>(lists.items.size()));
  }
  return lists;
}

}  // namespace duet
