// What the accuracy presets bought in the studies of tests/studies: what `duet explain` tells of a scene's
// preset.
#pragma once

#include <array>
#include <span>
#include <string_view>

namespace duet::scene {

// Errors of one measure under the presets draft, standard and fine, and processor seconds per simulated
// second.
struct PresetStudy {
  std::string_view study;    // "Stack at rest"
  std::string_view measure;  // "state"
  std::string_view unit;     // "m"; empty where the error is relative
  std::array<double, 3> error, seconds;
};

// In the order of the studies' names.
std::span<const PresetStudy> preset_studies();

}  // namespace duet::scene
