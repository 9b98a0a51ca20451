// Conversion of texts from files, names and paths into what may be shown on a terminal.
#pragma once

#include <string>
#include <string_view>

namespace duet {

/// Returns the text with everything that a terminal could take for a command written as `\xNN`, byte by byte.
/// This concerns control characters except line ends and tabs, characters that end a line or change the
/// direction of writing, and bytes that are not valid UTF-8.
std::string printable(std::string_view text);

/// Returns the text as printable() does, with line ends and tabs written as `\xNN`, too, so that it stays
/// within one line.
std::string printable_line(std::string_view text);

}  // namespace duet
