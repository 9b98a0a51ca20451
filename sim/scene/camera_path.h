// Where the camera is over time.
#pragma once

#include "sim/rigid/kinematic_motion.h"
#include "sim/scene/scene.h"

namespace duet::scene {

// Goes through the camera's keyframes, smoothly and without overshooting any, and rests before the first and
// after the last one; a camera without keyframes stays where it is.
class CameraPath {
 public:
  explicit CameraPath(const Camera& camera);

  Camera at(double time) const;  // s; its keyframes are empty

 private:
  Camera still_;
  PositionTrack position_, target_, vertical_fov_;  // the angle in degrees, along x
};

}  // namespace duet::scene
