#include "sim/scene/reader/camera_reader.h"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "sim/scene/camera_path.h"
#include "sim/scene/reader/table_reader.h"

namespace duet::scene {
namespace {

// The reason why a camera has no view.
struct NoView {
  std::string_view key;  // key of the camera at fault
  std::string message, hint;
};

// Returns why the camera has no view; none if it has one.
std::optional<NoView> no_view(const Camera& camera) {
  const Vec3 view = camera.target - camera.position;
  if (view.norm() == 0)
    return NoView{"target", "is the camera's own position, the view has no direction", ""};
  if (camera.up.norm() == 0) return NoView{"up", "has zero length", "[0, 1, 0] for an upright picture"};
  // The sine of the angle; below 1e-6 rounding of the coordinates would turn the picture.
  if (view.normalized().cross(camera.up.normalized()).norm() < 1e-6)
    return NoView{"up", "is parallel to the view from position to target",
                  "choose a direction across the view"};
  return {};
}

}  // namespace

void check_view(const Camera& camera, const toml::table& table, Problems& problems) {
  if (const std::optional<NoView> fault = no_view(camera))
    problems.add(place_of(table, fault->key), join_path("camera", fault->key), fault->message, fault->hint);
}

void check_moving_camera(const Scene& scene, const toml::table& table, Problems& problems) {
  const std::vector<ListedTable> keyframes = listed_tables(*table.get("keyframes"), "camera.keyframes");
  const std::size_t before = problems.count();
  if (keyframes.size() == 1)
    problems.add(keyframes[0].table->source(), keyframes[0].path, "is the only keyframe, must be at least 2",
                 "a camera that never moves needs none");
  check_times(keyframes, problems);
  if (problems.count() > before) return;
  const CameraPath path(scene.camera);
  for (int frame = 0; frame <= scene.frames; ++frame)
    if (const std::optional<NoView> fault = no_view(path.at(frame / scene.fps))) {
      problems.add(place_of(table, "keyframes"), "camera.keyframes",
                   fmt::format("in frame {} `{}` {}", frame, fault->key, fault->message), fault->hint);
      return;
    }
}

}  // namespace duet::scene
