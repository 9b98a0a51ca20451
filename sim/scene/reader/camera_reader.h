// Checks the rules of the camera. Internal to the reader: includes toml++.
#pragma once

#include "sim/scene/reader/document.h"
#include "sim/scene/scene.h"

namespace duet::scene {

/// Reports why a camera without keyframes has no view: its target is its position, or `up` is zero or along
/// the view. `table` is the table [camera].
void check_view(const Camera& camera, const toml::table& table, Problems& problems);
/// Reports flaws of the keyframes of the scene's camera, or the first frame in which it has no view. `table`
/// is the table [camera]. The number of frames and the whole camera must have been read without a problem.
void check_moving_camera(const Scene& scene, const toml::table& table, Problems& problems);

}  // namespace duet::scene
