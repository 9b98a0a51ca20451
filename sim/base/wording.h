// Words that many reports share.
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

/// Returns the count with the noun in its number, such as "1 vertex" and "4 vertices". A plural that is left
/// out is the singular and an s.
inline std::string counted(std::size_t count, std::string_view singular, std::string_view plural = {}) {
  if (count == 1 || plural.empty()) return fmt::format("{} {}{}", count, singular, count == 1 ? "" : "s");
  return fmt::format("{} {}", count, plural);
}

}  // namespace duet
