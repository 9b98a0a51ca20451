#include "sim/scene/build/motion.h"

#include <algorithm>
#include <limits>
#include <numbers>

namespace duet::scene {
namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double never = std::numeric_limits<double>::infinity();

AfterLastKey after_last_key(const Motion& motion) {
  return motion.loop ? AfterLastKey::repeat : AfterLastKey::stay;
}

// Returns the track of the body's keyframes that have a position; without any, the body stays in its place.
PositionTrack positions(const RigidBody& body) {
  std::vector<PositionKey> keys;
  for (const Keyframe& keyframe : body.motion.keyframes)
    if (keyframe.position) keys.push_back({keyframe.time, *keyframe.position, keyframe.velocity});
  if (keys.empty()) return {.time = {0}, .value = {body.placement.position}, .increment = {}};
  return position_track(keys, body.motion.interpolation, after_last_key(body.motion));
}

// Returns whether a keyframe of the body has a rotation.
bool has_turning_keyframes(const RigidBody& body) {
  const std::vector<Keyframe>& keyframes = body.motion.keyframes;
  return std::any_of(keyframes.begin(), keyframes.end(), [](const Keyframe& k) { return k.has_rotation; });
}

// Returns the track of the body's keyframes that have a rotation; without any, the body keeps its
// orientation.
OrientationTrack orientations(const RigidBody& body) {
  std::vector<OrientationKey> keys;
  for (const Keyframe& keyframe : body.motion.keyframes)
    if (keyframe.has_rotation)
      keys.push_back(
          {keyframe.time, keyframe.rotation.axis.normalized(), keyframe.rotation.degrees * degree});
  if (keys.empty()) return {.time = {0}, .value = {body.placement.orientation}, .increment = {}};
  return orientation_track(keys, body.motion.interpolation, after_last_key(body.motion));
}

}  // namespace

KinematicMotion kinematic_motion(const RigidBody& body, const Pose& frame) {
  KinematicMotion motion{positions(body), orientations(body), {}, {}, frame};
  if (has_turning_keyframes(body)) {  // these turn the body from its placement
    motion.frame.position = body.placement.orientation * frame.position;
    motion.frame.orientation = body.placement.orientation * frame.orientation;
  }
  for (const Spin& spin : body.motion.spin)
    motion.spins.push_back({spin.axis.normalized(), 2 * std::numbers::pi * spin.rate, spin.start,
                            spin.stop.value_or(never), spin.ramp});
  for (const Sinusoid& sinusoid : body.motion.sinusoid)
    motion.sinusoids.push_back({sinusoid.amplitude, sinusoid.rotation.vector(), sinusoid.frequency,
                                sinusoid.phase * degree, sinusoid.start, sinusoid.stop.value_or(never)});
  return motion;
}

}  // namespace duet::scene
