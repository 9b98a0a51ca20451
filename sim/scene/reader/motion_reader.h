// The rules of a kinematic body's motion. Internal to the reader: includes toml++.
#pragma once

#include <string>

#include "sim/scene/reader/document.h"
#include "sim/scene/scene.h"

namespace duet::scene {

// Reports what is wrong with the motion of the body, whose keys have been read from `body_table`; bodies
// without one have nothing wrong.
void check_motion(const RigidBody& body, const toml::table& body_table, const std::string& path,
                  Problems& problems);

}  // namespace duet::scene
