// Signed distance of rigid shapes in body space: negative inside, with the extended normal (valid on both
// sides), which the paper's contact needs before bodies touch. Exact for shapes with a formula; meshes have
// a grid.
#pragma once

#include <memory>

#include "sim/base/types.h"

namespace duet {

class GridLevelSet;

struct SignedDistance {
  double distance = 0;          // m, negative inside
  Vec3 normal = Vec3::UnitY();  // unit, its gradient
};

// Plain data; `kind` says which members count. All shapes but grids lie about the origin; capsules, cylinders
// and tori have the axis y.
struct LevelSet {
  enum class Kind { sphere, box, capsule, cylinder, torus, grid, half_space };
  Kind kind = Kind::sphere;
  double radius = 0;         // m, sphere, capsule, cylinder; of a torus' centre line
  Vec3 half = Vec3::Zero();  // m, half edge lengths, box
  double half_length = 0;    // m, half the height of a cylinder or of a capsule's straight part
  double tube = 0;           // m, radius of a torus' tube, less than `radius`
  std::shared_ptr<const GridLevelSet> grid = nullptr;  // grid, shared by all bodies of one mesh

  static LevelSet sphere(double radius) { return {.kind = Kind::sphere, .radius = radius}; }
  static LevelSet box(const Vec3& size) { return {.kind = Kind::box, .half = size / 2}; }
  static LevelSet capsule(double radius, double length) {  // `length` of the straight part
    return {.kind = Kind::capsule, .radius = radius, .half_length = length / 2};
  }
  static LevelSet cylinder(double radius, double height) {
    return {.kind = Kind::cylinder, .radius = radius, .half_length = height / 2};
  }
  static LevelSet torus(double radius, double tube) {
    return {.kind = Kind::torus, .radius = radius, .tube = tube};
  }
  static LevelSet mesh(std::shared_ptr<const GridLevelSet> grid) {
    return {.kind = Kind::grid, .grid = std::move(grid)};
  }
  static LevelSet half_space() { return {.kind = Kind::half_space}; }  // y <= 0

  bool operator==(const LevelSet&) const = default;

  double distance(const Vec3& x) const;  // m
  // Gradient of distance, unit length; any of the nearest ones where it is not unique.
  Vec3 normal(const Vec3& x) const;
  // Both, and those of meshes from their triangles: some ten times the time of a look at the grid.
  SignedDistance exact(const Vec3& x) const;
  // The distance of exact(), where it is known to be `at_most` (m) at most, on either side: the faster, the
  // nearer that is to the truth.
  double exact_distance(const Vec3& x, double at_most) const;
  double tolerance() const;        // m, of the distance: a cell of a grid, as at sharp edges; else zero
  double bounding_radius() const;  // m, about the origin; infinite for the half space
  Vec3 lower() const;              // m, bounds of the surface; not for the half space
  Vec3 upper() const;
  double smallest_size() const;  // m, diameter of the largest ball that fits inside
};

// Mass properties of homogeneous shapes of unit density, by closed formulas. Meshes: see triangle_mesh.h.
double volume(const LevelSet& shape);      // m^3
Vec3 unit_inertia(const LevelSet& shape);  // m^2, principal moments per unit mass in body axes

}  // namespace duet
