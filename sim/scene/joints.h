// Converts the joints of a scene to those of the simulator.
#pragma once

#include <vector>

#include "sim/articulation/joint.h"
#include "sim/scene/scene.h"
#include "sim/step/effects.h"

namespace duet::scene {

/// Returns the pose at the start that takes the coordinates of the body's shape to the world. For a kinematic
/// body it is that of its motion at time 0.
Pose start_of(const RigidBody& body);

/// Returns the pose that takes the frame of a joint to the coordinates that `axes` are given in. The x axis
/// is along `axes.axis`, the y axis along the component of `axes.up` at right angles to it. Without `up`, the
/// coordinate axis y is used, or z if the joint's axis is nearly parallel to y.
Pose frame_of(const JointAxes& axes);

/// The frames of a joint in its two bodies, as poses from the frame to the world, at the start.
struct JointPlaces {
  Pose parent,  ///< Frame that is fixed to the parent.
      child;    ///< Frame that is fixed to the child.
};
/// Returns the frames of `joint` at the start. `parent` and `child` are the poses of the shapes there, see
/// start_of().
JointPlaces places_of(const Joint& joint, const Pose& parent, const Pose& child);

/// Converts a joint, with angles in rad and frames in the coordinates of the shapes. `parent` and `child` are
/// the poses of the shapes at the start, see start_of(). Limits and control that `plan` leaves out are off.
/// The caller sets the numbers of the two bodies.
duet::Joint make_joint(const Joint& joint, const EffectSet& plan, const Pose& parent, const Pose& child);

}  // namespace duet::scene
