// Signed distance of rigid shapes in body space. It is negative inside, and its normal is defined on both
// sides, as contact needs it before bodies touch. Shapes with a formula give exact distances; meshes have a
// grid.
#pragma once

#include <memory>

#include "sim/base/assert.h"
#include "sim/base/types.h"

namespace duet {

class GridLevelSet;

/// A signed distance and its gradient.
struct SignedDistance {
  double distance = 0;          ///< Signed distance, m; negative inside.
  Vec3 normal = Vec3::UnitY();  ///< Unit gradient, outward.
};

/// A rigid shape as plain data; `kind` tells which members are used. All shapes except grids and the half
/// space are centered at the origin; capsules, cylinders and tori have the axis y.
struct LevelSet {
  /// The kinds of shapes.
  enum class Kind {
    sphere,     ///< Ball of `radius`.
    box,        ///< Box of half edge lengths `half`.
    capsule,    ///< Segment of `half_length`, thickened by `radius`.
    cylinder,   ///< Solid cylinder of `radius` and `half_length`.
    torus,      ///< Circle of `radius`, thickened by `tube`.
    grid,       ///< Closed mesh, see `grid`.
    half_space  ///< y <= 0.
  };
  Kind kind = Kind::sphere;  ///< Kind of this shape.
  /// Radius of a sphere, capsule, cylinder or of the center line of a torus, m.
  double radius = 0;
  Vec3 half = Vec3::Zero();  ///< Half edge lengths of a box, m.
  /// Half the height of a cylinder or of the straight part of a capsule, m.
  double half_length = 0;
  /// Radius of the tube of a torus, less than `radius`, m.
  double tube = 0;
  /// Level set of a mesh, shared by all bodies of one mesh; null for other kinds.
  std::shared_ptr<const GridLevelSet> grid = nullptr;

  /// Returns a sphere of the given radius (m).
  static LevelSet sphere(double radius) {
    DUET_ASSERT(radius > 0);
    return {.kind = Kind::sphere, .radius = radius};
  }
  /// Returns a box of the given edge lengths (m).
  static LevelSet box(const Vec3& size) {
    DUET_ASSERT(size.minCoeff() > 0);
    return {.kind = Kind::box, .half = size / 2};
  }
  /// Returns a capsule of the given radius whose straight part has the given length (m).
  static LevelSet capsule(double radius, double length) {
    DUET_ASSERT(radius > 0 && length >= 0);
    return {.kind = Kind::capsule, .radius = radius, .half_length = length / 2};
  }
  /// Returns a cylinder of the given radius and height (m).
  static LevelSet cylinder(double radius, double height) {
    DUET_ASSERT(radius > 0 && height > 0);
    return {.kind = Kind::cylinder, .radius = radius, .half_length = height / 2};
  }
  /// Returns a torus with the given radii of its center line and of its tube (m).
  static LevelSet torus(double radius, double tube) {
    DUET_ASSERT(tube > 0 && tube < radius);
    return {.kind = Kind::torus, .radius = radius, .tube = tube};
  }
  /// Returns the shape of a mesh.
  static LevelSet mesh(std::shared_ptr<const GridLevelSet> grid) {
    DUET_ASSERT(grid != nullptr);
    return {.kind = Kind::grid, .grid = std::move(grid)};
  }
  /// Returns the half space y <= 0.
  static LevelSet half_space() { return {.kind = Kind::half_space}; }

  /// Compares all members; grids are equal if they are the same object.
  bool operator==(const LevelSet&) const = default;

  /// Returns the signed distance (m) of the point `x` (m, body space), negative inside. Distances of meshes
  /// are those of GridLevelSet::distance().
  double distance(const Vec3& x) const;
  /// Returns the unit gradient of distance() at `x`. Where the gradient is not unique, it is one of those of
  /// the nearest surface points.
  Vec3 normal(const Vec3& x) const;
  /// Returns distance and normal at `x`, computed from the triangles for meshes. That takes about ten times
  /// as long as a look at the grid.
  SignedDistance exact(const Vec3& x) const;
  /// Returns the distance of exact(), given an upper bound `at_most` (m) of its magnitude. The search is
  /// faster, the tighter the bound; too small a bound costs time but does not change the result.
  double exact_distance(const Vec3& x, double at_most) const;
  /// Returns a bound on the error of distance() (m): one cell of the grid of a mesh, which is reached at
  /// sharp edges, else zero.
  double tolerance() const;
  /// Returns the radius of a ball about the origin that contains the shape (m); infinite for the half space.
  double bounding_radius() const;
  /// Returns the lower corner of the bounding box (m). It has no finite value for the half space.
  Vec3 lower() const;
  /// Returns the upper corner of the bounding box (m). It has no finite value for the half space.
  Vec3 upper() const;
  /// Returns the diameter of the largest ball that fits inside (m); infinite for the half space. Meshes give
  /// GridLevelSet::thickness().
  double min_size() const;
};

/// Returns the volume of a shape, m^3. It is infinite for the half space and for meshes, for which
/// mass_properties() exists.
double volume(const LevelSet& shape);
/// Returns the principal moments of inertia per unit mass of a homogeneous shape about its body axes, m^2.
/// They are infinite for the half space and for meshes, for which mass_properties() exists.
Vec3 unit_inertia(const LevelSet& shape);

}  // namespace duet
