#include "tools/replaceable.h"

#include <fmt/format.h>

#include "render/sequence.h"
#include "sim/base/error.h"
#include "sim/base/files.h"

namespace duet::tools {
namespace {

// Returns whether there is something that may be another's work.
bool is_in_the_way(const std::filesystem::path& file) {
  std::error_code missing;
  if (!std::filesystem::exists(file, missing)) return false;
  return !std::filesystem::is_regular_file(file, missing) || std::filesystem::file_size(file, missing) > 0;
}

[[noreturn]] void refuse(const std::filesystem::path& file, std::string_view what) {
  throw Error(
      ExitStatus::usage,
      fmt::format("{}: is no {} of this program, and stays untouched (give another path, or remove the "
                  "file first)",
                  file.string(), what));
}

}  // namespace

void require_own_picture(const std::filesystem::path& file, const std::string& maker, std::string_view what) {
  if (!is_in_the_way(file)) return;
  if (!std::filesystem::is_regular_file(file) || !render::is_made_by(file, maker)) refuse(file, what);
}

void require_own_text(const std::filesystem::path& file, std::string_view start, std::string_view what) {
  if (!is_in_the_way(file)) return;
  if (!std::filesystem::is_regular_file(file)) refuse(file, what);
  std::string text;
  io::read_pieces(file, [&](std::string_view piece) {
    text += piece;
    return text.size() < start.size();
  });
  if (!text.starts_with(start)) refuse(file, what);
}

}  // namespace duet::tools
