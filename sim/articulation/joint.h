// Joints between rigid bodies: the data that never changes during a run.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "sim/articulation/joint_target.h"
#include "sim/base/types.h"

namespace duet {

/// The motions of the child's joint frame, seen from the parent's, that a joint leaves free.
///
/// The x axis of a frame is the joint's own axis.
enum class JointKind {
  point,            ///< all rotations
  hinge,            ///< rotation about x
  universal,        ///< rotation about the parent's x and the child's y
  prismatic,        ///< travel along x
  prismatic_twist,  ///< travel along x and rotation about x
  weld              ///< none
};

/// Returns whether the joint leaves travel along x free.
inline bool travels(JointKind kind) {
  return kind == JointKind::prismatic || kind == JointKind::prismatic_twist;
}
/// Returns whether the joint has exactly one free angle, about x.
inline bool twists(JointKind kind) { return kind == JointKind::hinge || kind == JointKind::prismatic_twist; }
/// Returns whether the joint leaves any rotation free.
inline bool turns(JointKind kind) { return kind != JointKind::prismatic && kind != JointKind::weld; }

/// A closed interval of an angle (rad) or of a travel (m).
struct Bounds {
  /// Lower bound; minus infinity: none.
  double least = -std::numeric_limits<double>::infinity();
  /// Upper bound; infinity: none.
  double most = std::numeric_limits<double>::infinity();
  /// Returns whether there is a bound on either side.
  bool any() const { return std::isfinite(least) || std::isfinite(most); }
};

/// Proportional-derivative control of a joint's rotation, or of a prismatic joint's travel:
///
///     e'' + damping e' + gain e = 0
///
/// for the error e of the joint from its target (Weinstein, Guendelman, Fedkiw 2008).
struct JointControl {
  /// True if the joint is controlled.
  bool on = false;
  /// Proportional gain k_p, 1/s^2; it acts on the motion, whatever the masses are.
  double gain = 0;
  /// Derivative gain k_v, 1/s; 2 sqrt(k_p) is critical damping.
  double damping = 0;
  /// Largest torque about each axis, N m, or largest force of a travel, N; infinity: no bound.
  double most = std::numeric_limits<double>::infinity();
  /// Flags: rotation about x, y, z of the joint frame is controlled.
  ///
  /// Point and universal joints read it; joints with one free motion control that one.
  std::array<bool, 3> axis{true, true, true};
  /// True if the control knows the rate of the target, so that it does not lag by 2 / sqrt(k_p) seconds.
  bool leads = false;
  /// The rotation or travel that the joint is to reach, as a function of time.
  JointTarget target;
};

/// A joint between two rigid bodies.
struct Joint {
  /// Name in the scene file.
  std::string name;
  /// Kind of joint: the motions that are free.
  JointKind kind = JointKind::point;
  int parent = -1,    ///< rigid body that holds the parent frame
      child = -1;     ///< rigid body that holds the child frame
  Pose parent_frame,  ///< joint frame in the parent's body space
      child_frame;    ///< joint frame in the child's body space
  Bounds angle;       ///< rad, limits of the angle about x; read if twists() holds
  /// Largest angle between the x axes of the frames, rad; read for point joints; infinity: no limit.
  double swing = std::numeric_limits<double>::infinity();
  Bounds travel;  ///< m, limits of the travel along x; read if travels() holds
  /// Coulomb friction of each free motion that is not controlled: N m about, and N along its axis.
  double friction = 0;
  Vec3 parent_line = Vec3::Zero(),  ///< unit line of its taut chain in the parent's joint frame; zero: none
      child_line = Vec3::Zero();    ///< unit line of its taut chain in the child's joint frame; zero: none
  /// Returns whether the joint belongs to a taut chain, so that it cannot bend out of its line.
  bool is_taut() const { return !parent_line.isZero(0); }
  bool collides = false;  ///< true if parent and child can collide with each other
  JointControl control;   ///< proportional-derivative control
};

/// Returns whether the control of a joint counts whole turns.
inline bool counts_turns(const Joint& joint) { return joint.control.on && twists(joint.kind); }

/// All joints of a scene.
struct Articulation {
  /// The joints; their indices number the joints everywhere else.
  std::vector<Joint> joints;
  /// Returns whether the scene has no joints.
  bool empty() const { return joints.empty(); }
};

}  // namespace duet
