// Which look every body wears.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "sim/io/run_directory.h"
#include "sim/scene/scene.h"

namespace duet::render {

// The looks of a scene as a list, and for every body its place there. The first one is the default look,
// which bodies without a look wear; the second is the ground's.
struct LookTable {
  static constexpr int plain = 0, ground = 1;
  std::vector<scene::Look> looks;
  std::map<std::string, int> of_body;
};

// Throws FileError when the manifest names a look that the scene does not have.
LookTable assign_looks(const scene::Scene& scene, const io::Manifest& manifest);

// Largest number of looks that the shaders hold.
inline constexpr int max_looks = 256;

}  // namespace duet::render
