// Checks whether a command may replace a file: it may if it wrote that file itself.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace duet::tools {

/// Throws Error (usage) unless there is no such file, or it is empty, or a picture that the command `maker`
/// wrote. `what` names what the command writes: "preview".
void require_own_picture(const std::filesystem::path& file, const std::string& maker, std::string_view what);

/// Throws Error (usage) unless there is no such file, or it is empty, or it begins with `start`. `what` names
/// what the command writes: "mesh of tetrahedra".
void require_own_text(const std::filesystem::path& file, std::string_view start, std::string_view what);

}  // namespace duet::tools
