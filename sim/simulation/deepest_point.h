// Searches the points of triangles that lie deepest in a rigid body, between their corners as well.
#pragma once

#include "sim/contact/detection/body_bounds.h"
#include "sim/rigid/rigid_bodies.h"

namespace duet {

/// The deepest point found so far on a surface.
struct DeepestPoint {
  /// m, signed distance from the rigid body, less half the thickness around the surface; negative inside.
  double distance = 0;
  Vec3 place = Vec3::Zero();  ///< m, world space; means nothing unless `distance` is negative.
};

/// Searches one rigid body, the host, which must not move or be destroyed meanwhile. Searches of several
/// threads may share one object.
class DepthSearch {
 public:
  /// Prepares the search in the rigid body `host`, whose bounds are `bounds`. Triangles are subdivided until
  /// no edge is longer than `spacing` (m).
  DepthSearch(const RigidBodies& rigid, const BodyBounds& bounds, int host, double spacing);

  /// Updates `deepest` by the points of a triangle (m, world space) with the radius `around` (m) around it.
  ///
  /// Halves the triangle along its longest edge until its edges are no longer than the spacing. A part is
  /// skipped if none of its points can be deeper than the deepest one known: a signed distance changes by no
  /// more than the length of the displacement.
  void at_triangle(const Vec3& a, const Vec3& b, const Vec3& c, double around, DeepestPoint& deepest) const;

 private:
  double min_distance(const Vec3& x) const;
  void at(const Vec3& x, double around, DeepestPoint& deepest) const;

  const LevelSet& shape_;
  Pose pose_;                // of the shape of the host
  Eigen::AlignedBox3d box_;  // m, world; means nothing for a half space
  bool is_half_space_;
  double spacing_;  // m
};

}  // namespace duet
