// The material models of finite elements, as scenes name them.
#pragma once

#include <string_view>

namespace duet {

enum class MaterialModel { neo_hookean, corotated, st_venant_kirchhoff };
inline constexpr int material_model_count = 3;
inline constexpr std::string_view material_model_names[material_model_count] = {"neo_hookean", "corotated",
                                                                                "st_venant_kirchhoff"};

}  // namespace duet
