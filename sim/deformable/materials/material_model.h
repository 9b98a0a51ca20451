// The material models of finite elements and their names in scenes.
#pragma once

#include <string_view>

namespace duet {

/// Material model of a body of finite elements.
enum class MaterialModel {
  neo_hookean,         ///< neo-Hookean with an extrapolated volume term: neo_hookean.h
  corotated,           ///< fixed corotated: corotated.h
  st_venant_kirchhoff  ///< Saint Venant-Kirchhoff with extrapolated strains: st_venant_kirchhoff.h
};
/// Number of material models.
inline constexpr int material_model_count = 3;
/// Names of the models in scenes, in the order of the enum.
inline constexpr std::string_view material_model_names[material_model_count] = {"neo_hookean", "corotated",
                                                                                "st_venant_kirchhoff"};

}  // namespace duet
