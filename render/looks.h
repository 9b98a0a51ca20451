// Which look every body wears.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "sim/io/run_directory.h"
#include "sim/scene/scene.h"

namespace duet::render {

// The looks of a scene as a list, and for every body its place there. The first one is the default look,
// which static bodies without a look wear; the second is the ground's. Bodies without a look that move wear
// the colours of a palette, in turn.
struct LookTable {
  static constexpr int plain = 0, ground = 1;
  std::vector<scene::Look> looks;
  std::map<std::string, int> of_body;
  int strain = -1;  // what bodies wear that show their strain, -1 if none does; `inverted` comes next to it
};

// The ends of the scale of strains, and the colour of inverted elements, linear RGB.
inline const Vec3 unstrained_color(0.02, 0.10, 0.42), strained_color(1.0, 0.72, 0.05),
    inverted_color(0.9, 0.0, 0.01);

// Throws FileError when the manifest names a look that the scene does not have.
LookTable assign_looks(const scene::Scene& scene, const io::Manifest& manifest);

// Pattern of the looks that show strain: no scene can ask for it.
inline constexpr const char* strain_pattern = "strain";

// Largest number of looks that the shaders hold.
inline constexpr int max_looks = 256;

}  // namespace duet::render
