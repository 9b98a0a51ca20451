#include "sim/geometry/files/gltf_uri.h"

namespace duet {
namespace {

// Returns the value of a hexadecimal digit; -1 if the character is none.
int hexadecimal_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

}  // namespace

std::string percent_decoded(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool may_be_code = text[i] == '%' && i + 2 < text.size();
    const int high = may_be_code ? hexadecimal_digit(text[i + 1]) : -1,
              low = may_be_code ? hexadecimal_digit(text[i + 2]) : -1;
    if (high < 0 || low < 0 || high + low == 0) {
      result.push_back(text[i]);
      continue;
    }
    result.push_back(static_cast<char>(16 * high + low));
    i += 2;
  }
  return result;
}

std::string path_of_uri(const std::filesystem::path& folder, const std::string& uri) {
  std::error_code ignored;
  return std::filesystem::exists(folder / uri, ignored) ? uri : percent_decoded(uri);
}

}  // namespace duet
