// Assigns looks to bodies: those that the scene gives, and colors of a palette to the others.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "sim/io/run_directory.h"
#include "sim/scene/scene.h"

namespace duet::render {

/// The looks of a picture in a list, and the place in it for every body. Static bodies without a look have
/// the default look; moving ones without a look take the colors of a palette in turn.
struct LookTable {
  static constexpr int plain = 0,  ///< place of the default look
      ground = 1;                  ///< place of the look of the ground
  /// All looks: default, ground, those of the scene, then the used part of the palette, then those that show
  /// values.
  std::vector<scene::Look> looks;
  /// Place in `looks` by the name of a body.
  std::map<std::string, int> of_body;
  /// Place of the look of bodies whose colors show strain, stress or contact; -1: none does. The look of
  /// inverted elements is the next one.
  int of_values = -1;
};

inline const Vec3 low_color(0.02, 0.10, 0.42),  ///< color of the scale at 0, linear RGB
    high_color(1.0, 0.72, 0.05),     ///< color of the scale at Render::range_of_color(), linear RGB
    inverted_color(0.9, 0.0, 0.01);  ///< color of inverted elements, linear RGB

/// Makes the looks of a scene and assigns one to every body of `manifest`. If render.color is not look,
/// deformable bodies get the look that shows the quantity, those without strain only that of contact. Throws
/// FileError if the ground or a body has a look that the scene does not define, and Error (usage) if there
/// are more than max_looks.
LookTable assign_looks(const scene::Scene& scene, const io::Manifest& manifest);

/// Pattern of the look that shows values as colors. Scene files cannot ask for it.
inline constexpr const char* value_pattern = "value";

/// Largest number of looks that the shaders hold.
inline constexpr int max_looks = 256;

}  // namespace duet::render
