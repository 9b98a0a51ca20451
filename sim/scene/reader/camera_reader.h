// The rules of the camera. Internal to the reader: includes toml++.
#pragma once

#include "sim/scene/reader/document.h"
#include "sim/scene/scene.h"

namespace duet::scene {

// Reports why a camera that does not move has no view.
void check_view(const Camera& camera, const toml::table& table, Problems& problems);
// Reports what is wrong with the keyframes of the scene's camera, or the first frame that it has no view in.
// The number of frames and the whole camera must have been read without a problem.
void check_moving_camera(const Scene& scene, const toml::table& table, Problems& problems);

}  // namespace duet::scene
