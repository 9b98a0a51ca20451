// Sheets of triangles whose particles have mass and nothing else, for tests of collisions between surfaces.
#pragma once

#include <random>
#include <set>

#include "tests/support/meshes.h"

#include "sim/deformable/self_contact/collision_surface.h"
#include "sim/geometry/queries/triangle_intersection.h"

namespace duet::test {

struct Sheets {
  CollisionSurface surface;
  std::vector<Vec3> x;
  std::vector<double> inverse_mass;

  // A square of `count` by `count` quads across y, its corner at `corner`.
  void add(int count, double spacing, const Vec3& corner, double thickness, double friction = 0,
           bool itself = true) {
    const int first = static_cast<int>(x.size());
    for (int i = 0; i <= count; ++i)
      for (int k = 0; k <= count; ++k) {
        x.push_back(corner + spacing * Vec3(i, 0, k));
        inverse_mass.push_back(1 / (1 + 0.1 * ((3 * i + k) % 7)));
      }
    std::vector<Triangle> triangles;
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < count; ++k) {
        const int a = first + i * (count + 1) + k, b = a + count + 1;
        triangles.push_back({a, a + 1, b});
        triangles.push_back({b, a + 1, b + 1});
      }
    surface.add({itself, thickness, friction}, triangles, {});
    surface.initial = x;
  }
  std::size_t intersections() const { return intersecting_triangles(x, surface.triangles).size(); }
};

// Linear and angular momentum of displacements from `start`.
inline std::pair<Vec3, Vec3> momentum_of(const std::vector<Vec3>& start, const std::vector<Vec3>& end,
                                         const std::vector<double>& inverse_mass) {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  for (std::size_t p = 0; p < start.size(); ++p) {
    linear += (end[p] - start[p]) / inverse_mass[p];
    angular += start[p].cross(end[p] - start[p]) / inverse_mass[p];
  }
  return {linear, angular};
}

}  // namespace duet::test
