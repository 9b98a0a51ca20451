// Numbers in the program's sentences.
#pragma once

#include <cstdint>
#include <string>

namespace duet::tools {

/// "12 bytes", "3.4 kB", "5.6 MB" or "7.89 GB".
std::string size_text(std::uintmax_t bytes);

/// "1:02:03": hours, minutes and seconds.
std::string clock_text(double seconds);

/// "0.24 s", "35 s", "12 min", "2.6 h" or "3.2 days".
std::string duration_text(double seconds);

}  // namespace duet::tools
