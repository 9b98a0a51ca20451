// Words that the reports on triangle meshes and on tetrahedral meshes share.
#pragma once

#include <string>
#include <string_view>

#include <fmt/format.h>

#include "sim/base/types.h"

namespace duet {

/// Returns the position `x` with six digits, such as "[0.5, 1, 0.25]".
inline std::string place(const Vec3& x) {
  return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", x.x(), x.y(), x.z());
}

/// Returns the count with the noun in its number, such as "1 vertex" and "4 vertices".
inline std::string counted(std::size_t count, std::string_view singular, std::string_view plural) {
  return fmt::format("{} {}", count, count == 1 ? singular : plural);
}

}  // namespace duet
