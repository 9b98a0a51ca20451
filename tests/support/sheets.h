// Sheets of triangles whose particles have mass and no elasticity, to test collisions between surfaces.
#pragma once

#include <random>
#include <set>

#include "tests/support/meshes.h"

#include "sim/deformable/self_contact/collision_surface.h"
#include "sim/geometry/queries/triangle_intersection.h"

namespace duet::test {

// The collision surface of all sheets, with positions (m) and inverse masses (1/kg) of their particles.
struct Sheets {
  CollisionSurface surface;          // triangles of all sheets
  std::vector<Vec3> x;               // m, positions of the particles
  std::vector<double> inverse_mass;  // 1/kg

  // Adds a square of `count` x `count` quads in the plane across y. It extends from `corner` (m) along x and
  // z, with edges of `spacing` (m). With `itself`, the sheet collides with itself as well.
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
    surface.finish(x);
  }
  // Returns the number of pairs of triangles that intersect.
  std::size_t intersections() const { return intersecting_triangles(x, surface.triangles).size(); }
};

// Returns sum m d and sum x m d for the displacements d from `start` to `end` (m): the linear and angular
// momentum of moving so within one second.
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
