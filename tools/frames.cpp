#include <charconv>

#include "tools/commands.h"
#include <fmt/format.h>

#include "sim/base/frame_limits.h"

namespace duet::tools {
namespace {

std::optional<int> frame_number(std::string_view text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 0 || value > max_frames) return {};
  return value;
}

}  // namespace

Frames parse_frames(const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::optional<int> last = frame_number(colon == std::string::npos ? text : text.substr(colon + 1));
  const std::optional<int> first = colon == std::string::npos ? last : frame_number(text.substr(0, colon));
  if (!first || !last || *first > *last)
    throw Error(ExitStatus::usage,
                fmt::format("--frames {}: expected N or A:B with 0 <= A <= B <= {}", text, max_frames));
  return {colon == std::string::npos ? std::nullopt : first, *last};
}

}  // namespace duet::tools
