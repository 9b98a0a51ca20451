// Evaluates the camera of a scene over time.
#pragma once

#include "sim/rigid/kinematic_motion.h"
#include "sim/scene/scene.h"

namespace duet::scene {

/// The path of a camera through its keyframes. It is smooth, does not overshoot a keyframe, and rests before
/// the first and after the last one. A camera without keyframes stays where it is.
class CameraPath {
 public:
  /// Interpolates the keyframes of `camera`, whose times must increase.
  explicit CameraPath(const Camera& camera);

  /// Returns the camera, without keyframes, at `time` (s).
  Camera at(double time) const;

 private:
  Camera still_;                                    // the camera without keyframes
  PositionTrack position_, target_, vertical_fov_;  // m, m; the angle in degrees is the x component
};

}  // namespace duet::scene
