// From the joints of a scene to those of the simulator.
#pragma once

#include <vector>

#include "sim/articulation/joint.h"
#include "sim/scene/scene.h"
#include "sim/step/effects.h"

namespace duet::scene {

// The shape's own coordinates in the world at the start, also of a kinematic body.
Pose start_of(const RigidBody& body);

// The frame of a joint in the coordinates that its axes are given in: x along the axis, y along what of `up`
// is at right angles to it, or without one, along any.
Pose frame_of(const JointAxes& axes);

// Where the joint's frames are at the start in the world, by the shapes' poses there.
struct JointPlaces {
  Pose parent, child;
};
JointPlaces places_of(const Joint& joint, const Pose& parent, const Pose& child);

// The joint, with frames in the coordinates of the shapes; `parent` and `child` are the shapes' poses at the
// start. Control and limits that the plan leaves out are off.
duet::Joint make_joint(const Joint& joint, const EffectSet& plan, const Pose& parent, const Pose& child);

}  // namespace duet::scene
