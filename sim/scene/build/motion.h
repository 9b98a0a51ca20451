// Converts the motion of a kinematic body in a scene to the functions of time that the step evaluates.
#pragma once

#include "sim/scene/scene.h"

namespace duet::scene {

/// Returns the motion of `body` in SI units. `frame` is the body space in the coordinates of the shape, see
/// Solid::frame. Position and orientation come from the body's placement if no keyframe gives them; rotations
/// of keyframes turn the body from the orientation of its placement.
KinematicMotion kinematic_motion(const RigidBody& body, const Pose& frame);

}  // namespace duet::scene
