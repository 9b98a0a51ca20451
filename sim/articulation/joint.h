// Joints between rigid bodies: what never changes during a run.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "sim/articulation/joint_target.h"
#include "sim/base/types.h"

namespace duet {

// Which motions of the child's joint frame, seen from the parent's, a joint leaves free. The x axis is the
// joint's own.
//   point            all rotations
//   hinge            rotation about x
//   universal        rotation about the parent's x and the child's y
//   prismatic        travel along x
//   prismatic_twist  travel along x and rotation about it
//   weld             none
enum class JointKind { point, hinge, universal, prismatic, prismatic_twist, weld };

inline bool travels(JointKind kind) {
  return kind == JointKind::prismatic || kind == JointKind::prismatic_twist;
}
// Whether the joint has one angle, about x.
inline bool twists(JointKind kind) { return kind == JointKind::hinge || kind == JointKind::prismatic_twist; }
inline bool turns(JointKind kind) { return kind != JointKind::prismatic && kind != JointKind::weld; }

struct Bounds {
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  bool any() const { return std::isfinite(least) || std::isfinite(most); }
};

// Proportional-derivative control (Weinstein, Guendelman, Fedkiw 2008) of a joint's rotation, or of a
// prismatic one's travel: its error obeys e'' + damping e' + gain e = 0.
struct JointControl {
  bool on = false;
  double gain = 0;                                        // k_p, 1/s^2: acts on motion, not on mass
  double damping = 0;                                     // k_v, 1/s; 2 sqrt(k_p) is critical
  double most = std::numeric_limits<double>::infinity();  // N m, or N of a travel, about each axis
  std::array<bool, 3> axis{true, true, true};             // of the joint frame: x, y, z; a point joint's
  bool leads = false;  // knows the target's rate, so that it does not lag by 2 / sqrt(k_p) seconds
  JointTarget target;
};

struct Joint {
  std::string name;
  JointKind kind = JointKind::point;
  int parent = -1, child = -1;                             // rigid bodies
  Pose parent_frame, child_frame;                          // in body space
  Bounds angle;                                            // rad, of a joint that twists
  double swing = std::numeric_limits<double>::infinity();  // rad, most between the x axes; of a point joint
  Bounds travel;                                           // m
  double friction = 0;    // N m about, and N along, each axis that is free and not controlled
  bool collides = false;  // whether parent and child touch each other
  JointControl control;
};

struct Articulation {
  std::vector<Joint> joints;
  bool empty() const { return joints.empty(); }
};

}  // namespace duet
