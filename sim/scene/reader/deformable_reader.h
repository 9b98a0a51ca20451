// The rules of a deformable body's shape, thickness and pins. Internal to the reader: includes toml++.
#pragma once

#include <string>

#include "sim/scene/reader/document.h"
#include "sim/scene/reader/shape_reader.h"
#include "sim/scene/scene.h"

namespace duet::scene {

// Finishes the body's shape, whose keys have been read from `body_table`. Reports what is wrong with it.
void check_deformable(DeformableBody& body, const toml::table& body_table, const std::string& path,
                      ShapeReader& shapes, Problems& problems);

}  // namespace duet::scene
