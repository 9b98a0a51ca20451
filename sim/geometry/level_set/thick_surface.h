// The closed surfaces that give thin shells, rods and particles their thickness, as they are drawn and
// exported.
#pragma once

#include <span>

#include "sim/geometry/mesh/sheets.h"
#include "sim/geometry/mesh/surface.h"

namespace duet {

/// Both sides of a sheet, half a thickness from its nodes, and the rim between them.
class ThickSheet {
 public:
  /// Constructs the surface of `sheet` with the given thickness (m).
  ThickSheet(const Sheet& sheet, double thickness);
  /// Returns the surface at rest.
  const Surface& rest() const { return rest_; }
  /// Returns the node of the sheet at which a position of the surface is.
  std::size_t node(std::size_t position) const { return position % (rest_.positions.size() / 2); }
  /// Moves `surface`, a copy of rest(), to where the nodes of the sheet are at `x` (m, world).
  void update(std::span<const Vec3> x, Surface& surface) const;

 private:
  std::vector<Triangle> triangles_;
  double half_thickness_;
  Surface rest_;
};

/// The ball around a single particle.
class Bead {
 public:
  /// Constructs a ball of the given radius (m).
  explicit Bead(double radius);
  /// Returns the ball about the origin.
  const Surface& rest() const { return rest_; }
  /// Returns 0, the only particle, for each position of the surface.
  std::size_t node(std::size_t) const { return 0; }
  /// Moves `surface`, a copy of rest(), to the particle at x[0] (m, world).
  void update(std::span<const Vec3> x, Surface& surface) const;

 private:
  Surface rest_;
};

/// The tube around a curve, with flat ends if the curve is open.
class Tube {
 public:
  /// Constructs the tube of the given radius (m) around `curve`.
  Tube(const Curve& curve, double radius);
  /// Returns the surface at rest.
  const Surface& rest() const { return rest_; }
  /// Returns the node of the curve around which a position of the surface is.
  std::size_t node(std::size_t position) const;
  /// Moves `surface`, a copy of rest(), to where the nodes of the curve are at `x` (m, world). The rings do
  /// not twist along the curve; the twist that a closed curve needs to close is spread over all of it.
  void update(std::span<const Vec3> x, Surface& surface) const;

 private:
  // Returns the unit tangent at a node from its two neighbors; (0, 1, 0) if these coincide.
  Vec3 tangent(std::span<const Vec3> x, std::size_t node) const;

  double radius_;
  bool is_closed_;
  // Tangent and normal of the first ring at rest.
  Vec3 first_tangent_, first_normal_;
  Surface rest_;
};

}  // namespace duet
