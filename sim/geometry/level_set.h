// Signed distance of analytic shapes in body space: negative inside, exact everywhere, with the extended
// normal (valid on both sides), which the paper's contact needs before bodies touch.
#pragma once

#include "sim/base/types.h"

namespace duet {

// A shape whose signed distance is a formula. Plain data; `kind` says which members count.
struct LevelSet {
  enum class Kind { sphere, box, half_space };
  Kind kind = Kind::sphere;
  double radius = 0;         // m, sphere about the origin
  Vec3 half = Vec3::Zero();  // m, half edge lengths, box about the origin

  static LevelSet sphere(double radius) { return {Kind::sphere, radius, Vec3::Zero()}; }
  static LevelSet box(const Vec3& size) { return {Kind::box, 0, size / 2}; }
  static LevelSet half_space() { return {Kind::half_space, 0, Vec3::Zero()}; }  // y <= 0

  double distance(const Vec3& x) const;
  Vec3 normal(const Vec3& x)
      const;  // gradient of distance, unit length; any of the nearest ones where it is not unique
  double bounding_radius() const;  // m, about the origin; infinite for the half space
  Vec3 lower() const;              // m, bounds of the surface; not for the half space
  Vec3 upper() const { return -lower(); }
  double smallest_size() const;  // m, the smallest extent
};

// Mass properties of a homogeneous shape of unit mass about its centre, by closed formulas.
double volume(const LevelSet& shape);      // m^3
Vec3 unit_inertia(const LevelSet& shape);  // m^2, principal moments per unit mass in body axes

}  // namespace duet
