// Bounds on where bodies are and how fast their surfaces move. They tell, without looking at any surface
// point, that two bodies are apart and for how long they stay apart.
#pragma once

#include <vector>

#include "sim/state/bodies.h"

namespace duet {

/// Bounding volume of a body at one moment, with bounds on the velocities of its points.
///
/// The volume is a box with rounded edges: all points no farther than `radius` from the box with the half
/// sizes `half` along `axes` about `center`. Balls and capsules fill theirs exactly. If `is_half_space`, the
/// volume is instead the half space y <= 0 of the frame with the given axes about `center`.
struct BodyBounds {
  Vec3 center = Vec3::Zero();    ///< m, world: center of the box; of a half space, a point of its surface.
  Mat3 axes = Mat3::Identity();  ///< Unit axes of the box in the world, one in each column.
  Vec3 half = Vec3::Zero();      ///< m: half sizes of the box along `axes`, without `radius`.
  double radius = 0;             ///< m: by how much the box is grown on all sides.
  Vec3 velocity = Vec3::Zero();  ///< m/s, world: center of the range of the velocities of the points.
  /// m/s, along world axes: half sizes of the range of velocities. bound_bodies() sets zero for rigid bodies,
  /// the points of which `spin` tells apart.
  Vec3 velocity_half = Vec3::Zero();
  /// rad/s, world: the part of the angular velocity that moves the surface. It is zero for balls and
  /// deformable bodies, and without the component along the axis for bodies that are round about one.
  Vec3 spin = Vec3::Zero();
  double arm = 0;              ///< m: lever arm on which `spin` moves the surface, at most.
  double thickness = 0;        ///< m: LevelSet::min_size() of a rigid body. Zero for deformable bodies.
  bool is_half_space = false;  ///< True if the volume is a half space; `half` and `radius` then mean nothing.
  bool is_static = false;      ///< True if the body is rigid and never moves.
  bool is_dynamic = true;      ///< True if forces move the body, and for all deformable bodies.
  bool is_deformable = false;  ///< True if the body is deformable.
};

/// Sets `bounds` to those of all rigid bodies and then all deformable bodies, from their present positions
/// and velocities.
void bound_bodies(const Bodies& bodies, std::vector<BodyBounds>& bounds);

/// Returns whether a body touches with the vertices of a skin, which its tetrahedra carry, instead of with
/// its own boundary.
bool touches_with_skin(const Bodies& bodies, const DeformableBody& body);

/// Returns the axis-aligned world box around the body, grown by `margin` (m). It means nothing for half
/// spaces.
Eigen::AlignedBox3d world_box(const BodyBounds& body, double margin);

/// Returns an upper bound on the speed of all points of the body, m/s.
double fastest(const BodyBounds& body);

/// Returns a lower bound on the distance of two bodies, m. It is negative if no separating plane is found
/// across the axes of either box or across the line between the centers. It is exact for balls, and for boxes
/// that face each other with their faces.
double separation(const BodyBounds& a, const BodyBounds& b);

/// Returns a time (s) within which two bodies, as they move now, surely get no more than `depth` (m) deeper
/// into each other.
///
/// For each tried plane with the unit normal e across which the bodies are at least -`depth` apart, the time
/// t solves u t + |e . gravity| t^2 = max(gap - depth / 2, depth), where `gap` is the distance along e and u
/// bounds the speed of approach along e. The result is the longest of these times. Bodies farther apart than
/// `depth` do not touch within it. The term with `gravity` (m/s^2, world) is there because either body may
/// fall while something holds the other: a step of t takes it up to |e . gravity| t^2 farther along e. If
/// no plane separates the bodies, the result is the time in which no point moves farther than `depth`.
double time_apart(const BodyBounds& a, const BodyBounds& b, double depth, const Vec3& gravity);

}  // namespace duet
