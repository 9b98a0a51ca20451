#include "sim/articulation/joint_rows.h"

#include <cmath>
#include <numbers>

#include "sim/articulation/block_factor.h"
#include "sim/base/assert.h"
#include "sim/base/elementary.h"

namespace duet {
namespace {

// JointRow::axis of the only rotation row of a universal joint, which keeps the parent's x and the child's y
// at right angles.
constexpr int across = 3;

// Returns the axes along which the joint fixes travel.
std::vector<int> fixed_travels(JointKind kind) {
  return travels(kind) ? std::vector<int>{1, 2} : std::vector<int>{0, 1, 2};
}

// Returns the axes about which the joint fixes rotation.
std::vector<int> fixed_turns(JointKind kind) {
  switch (kind) {
    case JointKind::point:
      return {};
    case JointKind::hinge:
    case JointKind::prismatic_twist:
      return {1, 2};
    case JointKind::universal:
      return {across};
    case JointKind::prismatic:
    case JointKind::weld:
      return {0, 1, 2};
  }
  return {};
}

// Returns the axes about which the joint leaves rotation free.
std::vector<int> free_turns(JointKind kind) {
  switch (kind) {
    case JointKind::point:
      return {0, 1, 2};
    case JointKind::hinge:
    case JointKind::prismatic_twist:
      return {0};
    case JointKind::universal:
      return {0, 1};
    case JointKind::prismatic:
    case JointKind::weld:
      return {};
  }
  return {};
}

Vec3 unit(int axis) { return Vec3::Unit(axis); }

// Returns the world direction of a free axis of rotation.
Vec3 turning_axis(const Joint& joint, const JointFrames& frames, int axis) {
  const bool of_child = joint.kind == JointKind::universal && axis == 1;
  return (of_child ? frames.child_axes : frames.parent_axes) * unit(axis);
}

// Returns one of the two world directions across the line of a taut chain, which turns with the parent.
Vec3 bending_axis(const Joint& joint, const JointRow& row, const JointFrames& frames) {
  const Vec3 across_line = joint.parent_line.unitOrthogonal();
  return frames.parent_axes * (row.axis == 0 ? across_line : Vec3(joint.parent_line.cross(across_line)));
}

// Returns the world direction of a rotation row, by which relative angular velocity is measured.
Vec3 turning_direction(const Joint& joint, const JointRow& row, const JointFrames& frames,
                       const Quat& reference) {
  if (row.motion == RowMotion::bend) return bending_axis(joint, row, frames);
  if (row.motion == RowMotion::swing) {
    const Vec3 from = frames.parent_axes * unit(0), to = frames.child_axes * unit(0);
    const Vec3 axis = from.cross(to);
    return axis.squaredNorm() > 0 ? Vec3(-axis.normalized()) : Vec3(frames.parent_axes * unit(1));
  }
  if (row.role == RowRole::limit) return row.side * turning_axis(joint, frames, 0);
  if (row.role != RowRole::structure) return turning_axis(joint, frames, row.axis);
  if (row.axis == across) return (frames.child_axes * unit(1)).cross(frames.parent_axes * unit(0));
  // d/dt 2 vec(J) = s w + w x v for the relative rotation J = (s, v) and its rate w in the parent's frame:
  // the row is the derivative of the error of section 5.1.
  const Vec3 local = reference.w() * unit(row.axis) + Vec3(reference.vec()).cross(unit(row.axis));
  return frames.parent_axes * local;
}

}  // namespace

JointFrames::JointFrames(const Joint& joint, const Pose& parent_pose, const Pose& child_pose)
    : parent(parent_pose.to_world(joint.parent_frame.position)),
      child(child_pose.to_world(joint.child_frame.position)),
      parent_axes(parent_pose.orientation * joint.parent_frame.orientation),
      child_axes(child_pose.orientation * joint.child_frame.orientation) {}

std::vector<JointRow> rows_of(const Joint& joint) {
  std::vector<JointRow> rows;
  const auto add = [&](RowRole role, RowMotion motion, int axis, double side = 1) {
    JointRow row;
    row.role = role;
    row.motion = motion;
    row.axis = axis;
    row.side = side;
    rows.push_back(row);
  };
  for (const int axis : fixed_travels(joint.kind)) add(RowRole::structure, RowMotion::travel, axis);
  for (const int axis : fixed_turns(joint.kind)) add(RowRole::structure, RowMotion::turn, axis);
  if (joint.is_taut())
    for (const int axis : {0, 1}) add(RowRole::structure, RowMotion::bend, axis);
  const JointControl& control = joint.control;
  const bool controls_travel = control.on && joint.kind == JointKind::prismatic;
  if (controls_travel) add(RowRole::control, RowMotion::travel, 0);
  for (const int axis : free_turns(joint.kind)) {
    const bool all = joint.kind != JointKind::point && joint.kind != JointKind::universal;
    if (control.on && (all || control.axis[static_cast<std::size_t>(axis)]))
      add(RowRole::control, RowMotion::turn, axis);
    else if (joint.friction > 0)
      add(RowRole::friction, RowMotion::turn, axis);
  }
  if (joint.friction > 0 && travels(joint.kind) && !controls_travel)
    add(RowRole::friction, RowMotion::travel, 0);
  const auto add_limits = [&](const Bounds& bounds, RowMotion motion) {
    if (bounds.any()) add(RowRole::limit, motion, 0);  // update_rows() chooses the side
  };
  if (twists(joint.kind)) add_limits(joint.angle, RowMotion::turn);
  if (travels(joint.kind)) add_limits(joint.travel, RowMotion::travel);
  if (joint.kind == JointKind::point && std::isfinite(joint.swing))
    add(RowRole::limit, RowMotion::swing, 0, -1);
  DUET_ASSERT(rows.size() <= static_cast<std::size_t>(BlockFactor::max_rows));
  return rows;
}

double travel_of(const JointFrames& frames) { return frames.gap().dot(frames.parent_axes * unit(0)); }

double angle_of(const JointFrames& frames) {
  const Quat relative = frames.relative();
  const double angle = 2 * math::atan2(relative.x(), relative.w());
  return std::remainder(angle, 2 * std::numbers::pi);
}

double swing_of(const JointFrames& frames) {
  const Vec3 from = frames.parent_axes * unit(0), to = frames.child_axes * unit(0);
  return math::atan2(from.cross(to).norm(), from.dot(to));
}

void update_rows(const Joint& joint, const Pose& parent, const Pose& child, JointRow* row, std::size_t count,
                 Quat& reference) {
  const JointFrames frames(joint, parent, child);
  reference = frames.relative();
  if (reference.w() < 0) reference.coeffs() *= -1;
  // Rows of a joint with free travel turn with the parent and act at the child's anchor. Rows of other joints
  // have world axes and act between the anchors.
  const Vec3 place = travels(joint.kind) ? frames.child : Vec3((frames.parent + frames.child) / 2);
  for (std::size_t i = 0; i < count; ++i) {
    JointRow& r = row[i];
    if (r.role == RowRole::limit && r.motion != RowMotion::swing) {
      const Bounds& bounds = r.motion == RowMotion::turn ? joint.angle : joint.travel;
      const double value = r.motion == RowMotion::turn ? angle_of(frames) : travel_of(frames);
      r.side = value - bounds.least < bounds.most - value ? 1 : -1;
    }
    if (r.motion == RowMotion::travel) {
      const bool follows_parent = travels(joint.kind);
      r.linear = follows_parent ? Vec3(frames.parent_axes * unit(r.axis)) : unit(r.axis);
      if (r.role == RowRole::limit) r.linear *= r.side;
      r.parent_moment = (place - parent.position).cross(r.linear);
      r.child_moment = (place - child.position).cross(r.linear);
    } else {
      r.linear.setZero();
      r.parent_moment = r.child_moment = turning_direction(joint, r, frames, reference);
    }
  }
}

double structure_error(const Joint& joint, const JointRow& row, const JointFrames& frames,
                       const Quat& reference) {
  DUET_ASSERT(row.role == RowRole::structure);
  DUET_ASSERT(is_unit(reference));
  if (row.motion == RowMotion::travel)
    return travels(joint.kind) ? frames.gap().dot(frames.parent_axes * unit(row.axis))
                               : frames.gap()[row.axis];
  if (row.motion == RowMotion::bend)
    return (frames.parent_axes * joint.parent_line)
        .cross(frames.child_axes * joint.child_line)
        .dot(bending_axis(joint, row, frames));
  if (row.axis == across) return (frames.parent_axes * unit(0)).dot(frames.child_axes * unit(1));
  const Quat relative = frames.relative();
  const double sign = relative.dot(reference) < 0 ? -1 : 1;
  return 2 * sign * relative.vec()[row.axis];
}

double limit_slack(const Joint& joint, const JointRow& row, const JointFrames& frames) {
  DUET_ASSERT(row.role == RowRole::limit);
  if (row.motion == RowMotion::swing) return joint.swing - swing_of(frames);
  const Bounds& bounds = row.motion == RowMotion::turn ? joint.angle : joint.travel;
  const double value = row.motion == RowMotion::turn ? angle_of(frames) : travel_of(frames);
  return row.side > 0 ? value - bounds.least : bounds.most - value;
}

}  // namespace duet
