// Text of files, names and paths as it may be shown on a terminal.
#pragma once

#include <string>
#include <string_view>

namespace duet {

/// The text with all that a terminal could take for a command as \xNN, a byte each: control characters but
/// line ends and tabs, those that turn the direction of writing, and bytes that are no UTF-8.
std::string printable(std::string_view text);

/// The same with line ends and tabs as \xNN, too: the result stays within one line.
std::string printable_line(std::string_view text);

}  // namespace duet
