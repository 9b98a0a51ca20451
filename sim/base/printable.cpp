#include "sim/base/printable.h"

#include <cstdint>

#include <fmt/format.h>

namespace duet {
namespace {

// A decoded character.
struct Character {
  std::uint32_t code = 0;
  std::size_t size = 1;  // bytes
  bool is_valid = false;
};

// Decodes the first UTF-8 character of a text that is not empty. Overlong forms, surrogates and codes beyond
// Unicode are not valid.
Character first_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return {lead, 1, true};
  const std::size_t size = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < size) return {};
  std::uint32_t code = lead & (0xffU >> (size + 1));
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xc0U) != 0x80) return {};
    code = code << 6 | (byte(i) & 0x3fU);
  }
  constexpr std::uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool is_surrogate = code >= 0xd800 && code <= 0xdfff;
  return {code, size, code >= least[size] && code <= 0x10ffff && !is_surrogate};
}

// Returns whether a terminal could take the character for a command: control characters, line and paragraph
// separators, and characters that change the direction of writing.
bool commands_terminal(std::uint32_t code) {
  const bool is_control = code < 0x20 || (code >= 0x7f && code < 0xa0);
  const bool ends_line = code == 0x2028 || code == 0x2029;
  const bool turns_writing = (code >= 0x202a && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069);
  return is_control || ends_line || turns_writing;
}

// Returns the text with every invalid byte and every character that could command a terminal as \xNN, except
// the single-byte characters in `kept`.
std::string shown(std::string_view text, std::string_view kept) {
  std::string result;
  while (!text.empty()) {
    const Character character = first_character(text);
    const std::size_t size = character.is_valid ? character.size : 1;
    const std::string_view bytes = text.substr(0, size);
    const bool is_kept = size == 1 && kept.find(bytes[0]) != std::string_view::npos;
    if (is_kept || (character.is_valid && !commands_terminal(character.code))) {
      result += bytes;
    } else {
      for (const char c : bytes) result += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    }
    text.remove_prefix(size);
  }
  return result;
}

}  // namespace

std::string printable(std::string_view text) { return shown(text, "\n\t"); }
std::string printable_line(std::string_view text) { return shown(text, {}); }

}  // namespace duet
