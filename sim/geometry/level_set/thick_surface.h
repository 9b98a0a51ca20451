// The closed surfaces that give thin shells, rods and particles their thickness, as they are drawn and
// exported.
#pragma once

#include <span>

#include "sim/geometry/mesh/sheets.h"
#include "sim/geometry/mesh/surface.h"

namespace duet {

// Both sides of a sheet, half a thickness from its nodes, and the rim between them.
class ThickSheet {
 public:
  ThickSheet(const Sheet& sheet, double thickness);
  const Surface& rest() const { return rest_; }
  // Moves `surface`, a copy of rest(), to where the nodes are at `x` (m).
  void update(std::span<const Vec3> x, Surface& surface) const;

 private:
  std::vector<Triangle> triangles_;
  double half_thickness_;
  Surface rest_;
};

// The ball around a single particle.
class Bead {
 public:
  explicit Bead(double radius);
  const Surface& rest() const { return rest_; }
  void update(std::span<const Vec3> x, Surface& surface) const;

 private:
  Surface rest_;
};

// The tube around a curve, with flat ends.
class Tube {
 public:
  Tube(const Curve& curve, double radius);
  const Surface& rest() const { return rest_; }
  void update(std::span<const Vec3> x, Surface& surface) const;

 private:
  Vec3 tangent(std::span<const Vec3> x, std::size_t node) const;

  double radius_;
  bool is_closed_;
  Vec3 first_tangent_, first_normal_;  // at rest: where the first ring begins
  Surface rest_;
};

}  // namespace duet
