// From the motion of a rigid body in a scene to the functions of time that the step evaluates.
#pragma once

#include "sim/scene/scene.h"

namespace duet::scene {

// `frame`: body space in the shape's own coordinates, as of Solid. What no keyframe says, the body's
// placement says.
KinematicMotion kinematic_motion(const RigidBody& body, const Pose& frame);

}  // namespace duet::scene
