// The rules of joints. Internal to the reader: includes toml++.
#pragma once

#include <string>

#include "sim/scene/reader/document.h"
#include "sim/scene/scene.h"

namespace duet::scene {

// Reports what is wrong with a joint, whose keys have been read from `table`, in a scene whose bodies have
// been read.
void check_joint(const Joint& joint, const Scene& scene, const toml::table& table, const std::string& path,
                 Problems& problems);

}  // namespace duet::scene
