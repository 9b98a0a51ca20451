// Checks the rules of joints. Internal to the reader: includes toml++.
#pragma once

#include <string>

#include "sim/scene/reader/document.h"
#include "sim/scene/scene.h"

namespace duet::scene {

/// Reports flaws of `joint`, whose keys have been read from `table` without a problem. `path` is the path of
/// the table. The rigid bodies and the ground of `scene` must have been read, as the frames of the joint are
/// compared with the poses of its bodies at the start.
void check_joint(const Joint& joint, const Scene& scene, const toml::table& table, const std::string& path,
                 Problems& problems);

}  // namespace duet::scene
