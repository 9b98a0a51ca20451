// Joints as rows of constraints on velocities.
#pragma once

#include <vector>

#include "sim/articulation/joint.h"

namespace duet {

// structure: what makes the joint; control and friction: a wanted rate, reached by a bounded impulse; limit:
// one-sided.
enum class RowRole { structure, control, friction, limit };
enum class RowMotion { travel, turn, swing };

// The velocity of a row is linear.(v_c - v_p) + child_moment.w_c - parent_moment.w_p, of the child relative
// to the parent; an impulse y on it gives the child the impulse y linear and the angular impulse y
// child_moment, and the parent the opposite. Both act at one place, so that linear and angular momentum are
// kept.
struct JointRow {
  RowRole role = RowRole::structure;
  RowMotion motion = RowMotion::travel;
  int axis = 0;     // of the joint frame: x, y, z
  double side = 1;  // of a limit: 1 keeps the value above the least, -1 below the most
  Vec3 linear = Vec3::Zero();
  Vec3 parent_moment = Vec3::Zero(), child_moment = Vec3::Zero();  // about the centres of mass
};

// Where the two frames of a joint stand, in the world.
struct JointFrames {
  Vec3 parent, child;  // m
  Quat parent_axes, child_axes;
  JointFrames(const Joint& joint, const Pose& parent_pose, const Pose& child_pose);
  Quat relative() const { return parent_axes.conjugate() * child_axes; }  // from parent to child
  Vec3 gap() const { return child - parent; }                             // m
};

// The rows of a joint, in the order of their roles.
std::vector<JointRow> rows_of(const Joint& joint);

// Directions and moments at the given poses. `reference` is relative() there with a scalar part >= 0.
void update_rows(const Joint& joint, const Pose& parent, const Pose& child, JointRow* row, std::size_t count,
                 Quat& reference);

// By how much a row of the structure is violated with the frames where they are (m, or rad for small errors):
// of rotations twice the vector part of q_p^-1 q_c, which is zero for both signs of the quaternion (section
// 5.1). The sign is the one nearer to `reference`.
double structure_error(const Joint& joint, const JointRow& row, const JointFrames& frames,
                       const Quat& reference);
// By how much a limit is kept, m or rad; negative where it is passed.
double limit_slack(const Joint& joint, const JointRow& row, const JointFrames& frames);

double travel_of(const JointFrames& frames);  // m, along the parent's x
double angle_of(const JointFrames& frames);   // rad, about x, in (-pi, pi]
double swing_of(const JointFrames& frames);   // rad, between the x axes

}  // namespace duet
