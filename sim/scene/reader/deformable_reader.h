// Checks the rules of a deformable body's shape, thickness, bonds, skin and pins. Internal to the reader:
// includes toml++.
#pragma once

#include <string>

#include "sim/scene/reader/document.h"
#include "sim/scene/reader/shape_reader.h"
#include "sim/scene/scene.h"

namespace duet::scene {

/// Sets the kind of the body's shape, loads its meshes, gives a volume that fills a mesh its skin, and
/// reports flaws to `problems`. The keys of the body have been read from `body_table`, which is at `path` in
/// the document.
void check_deformable(DeformableBody& body, const toml::table& body_table, const std::string& path,
                      ShapeReader& shapes, Problems& problems);

}  // namespace duet::scene
