// Checks the rules of a kinematic body's motion. Internal to the reader: includes toml++.
#pragma once

#include <string>

#include "sim/scene/reader/document.h"
#include "sim/scene/scene.h"

namespace duet::scene {

/// Reports flaws of the motion of `body`, whose keys have been read from `body_table`, the table at `path`.
/// Does nothing for a body without a motion.
void check_motion(const RigidBody& body, const toml::table& body_table, const std::string& path,
                  Problems& problems);

}  // namespace duet::scene
