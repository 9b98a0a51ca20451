// Gives the errors and costs of the accuracy presets that the studies in tests/studies measured, which
// `duet explain` prints beside a scene's preset.
#pragma once

#include <array>
#include <span>
#include <string_view>

namespace duet::scene {

/// Errors and costs of the presets draft, standard and fine in one study.
struct PresetStudy {
  std::string_view study;       ///< Name of the study, such as "Stack at rest".
  std::string_view measure;     ///< What is compared with the reference, such as "state".
  std::string_view unit;        ///< Unit of the error, such as "m"; empty: the error is relative.
  std::array<double, 3> error,  ///< Error under draft, standard and fine, in `unit`.
      seconds;                  ///< Processor seconds per simulated second under draft, standard and fine.
};

/// Returns all studies, in the order of their names.
std::span<const PresetStudy> preset_studies();

}  // namespace duet::scene
