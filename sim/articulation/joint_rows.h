// Joints as rows of constraints on velocities, and the errors of their positions.
#pragma once

#include <vector>

#include "sim/articulation/joint.h"

namespace duet {

/// The purpose of a row of a joint.
enum class RowRole {
  structure,  ///< equality constraint that makes the joint
  control,    ///< wanted rate of a controlled motion, reached by a bounded impulse
  friction,   ///< rate zero of a free motion, reached by a bounded impulse
  limit       ///< one-sided constraint at a bound of a free motion
};
/// The relative motion of the two frames that a row measures.
enum class RowMotion {
  travel,  ///< translation along a direction
  turn,    ///< rotation about an axis
  swing,   ///< rotation that changes the angle between the x axes
  bend     ///< rotation across the line of a taut chain
};

/// A scalar constraint on the relative velocity of a joint's bodies:
///
///     velocity = linear . (v_c - v_p) + child_moment . w_c - parent_moment . w_p
///
/// for the parent p and the child c. An impulse y on the row gives the child the impulse y linear and the
/// angular impulse y child_moment, and the parent the impulse -y linear and the angular impulse
/// -y parent_moment. Both act at one place, so that linear and angular momentum are kept.
struct JointRow {
  /// Purpose of the row.
  RowRole role = RowRole::structure;
  /// Motion that it measures.
  RowMotion motion = RowMotion::travel;
  /// Axis of the joint frame: 0, 1, 2 for x, y, z.
  ///
  /// 3 marks the rotation row of a universal joint, which keeps the parent's x and the child's y at right
  /// angles. For RowMotion::bend it is 0 or 1, for the two directions across the line.
  int axis = 0;
  /// Side of a limit row: 1 keeps the value above the lower bound, -1 below the upper bound.
  double side = 1;
  /// Unit direction in world axes; zero for rotations.
  Vec3 linear = Vec3::Zero();
  Vec3 parent_moment = Vec3::Zero(),  ///< about the parent's center of mass: m, or a direction for rotations
      child_moment = Vec3::Zero();    ///< about the child's center of mass: m, or a direction for rotations
};

/// The two frames of a joint in the world.
struct JointFrames {
  Vec3 parent,       ///< m, anchor on the parent
      child;         ///< m, anchor on the child
  Quat parent_axes,  ///< parent's joint frame to the world
      child_axes;    ///< child's joint frame to the world
  /// Places the frames of `joint` for the given poses of its bodies.
  JointFrames(const Joint& joint, const Pose& parent_pose, const Pose& child_pose);
  /// Returns the rotation from the parent's frame to the child's, in the parent's frame.
  Quat relative() const { return parent_axes.conjugate() * child_axes; }
  /// Returns the vector from the parent's anchor to the child's, m, world axes.
  Vec3 gap() const { return child - parent; }
};

/// Returns the rows of a joint in the order structure, control and friction, limits.
///
/// Only `role`, `motion`, `axis` and `side` are set; update_rows() sets directions and moments. At most
/// BlockFactor::max_rows rows.
std::vector<JointRow> rows_of(const Joint& joint);

/// Sets the directions and moments of the `count` rows at `row` for the given poses of the joint's bodies.
///
/// Limit rows take the side of the bound that is nearer. `reference` becomes JointFrames::relative() at these
/// poses, with the sign that has a scalar part >= 0; structure_error() needs it.
void update_rows(const Joint& joint, const Pose& parent, const Pose& child, JointRow* row, std::size_t count,
                 Quat& reference);

/// Returns the error of a structure row with the frames where they are: m, or for rotations rad to first
/// order.
///
/// The error of a rotation is twice the vector part of q_p^-1 q_c (Shinar et al. 2008, section 5.1), with the
/// sign of the quaternion that is nearer to `reference`. The rotation row of a universal joint has the
/// error x_p . y_c instead.
double structure_error(const Joint& joint, const JointRow& row, const JointFrames& frames,
                       const Quat& reference);
/// Returns the distance of a limit row from its bound, m or rad; negative if the bound is violated.
double limit_slack(const Joint& joint, const JointRow& row, const JointFrames& frames);

/// Returns the travel along the parent's x axis, m.
double travel_of(const JointFrames& frames);
/// Returns the angle about x, rad, in [-pi, pi].
double angle_of(const JointFrames& frames);
/// Returns the angle between the x axes of the frames, rad, in [0, pi].
double swing_of(const JointFrames& frames);

}  // namespace duet
