#include "sim/scene/camera_path.h"

#include <vector>

namespace duet::scene {
namespace {

// Returns the smooth track of one quantity through the keyframes of the camera; value_of(keyframe) gives it
// as a vector. Without keyframes the track rests at value_of(CameraKey()).
template <class ValueOf>
PositionTrack track(const Camera& camera, ValueOf&& value_of) {
  std::vector<PositionKey> keys;
  for (const CameraKey& keyframe : camera.keyframes) keys.push_back({keyframe.time, value_of(keyframe), {}});
  if (keys.empty()) keys.push_back({0, value_of(CameraKey()), {}});
  return position_track(keys, Interpolation::smooth, AfterLastKey::stay);
}

}  // namespace

CameraPath::CameraPath(const Camera& camera)
    : still_(camera),
      position_(track(camera, [&](const CameraKey& key) { return key.position.value_or(camera.position); })),
      target_(track(camera, [&](const CameraKey& key) { return key.target.value_or(camera.target); })),
      vertical_fov_(track(camera, [&](const CameraKey& key) -> Vec3 {
        return key.vertical_fov.value_or(camera.vertical_fov) * Vec3::UnitX();
      })) {
  still_.keyframes.clear();
}

Camera CameraPath::at(double time) const {
  Camera camera = still_;
  camera.position = position_at(position_, time);
  camera.target = position_at(target_, time);
  camera.vertical_fov = position_at(vertical_fov_, time).x();
  return camera;
}

}  // namespace duet::scene
