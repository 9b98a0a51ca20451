// Searches in texts that a program has written.
#pragma once

#include <string>

namespace duet::test {

// Returns whether `part` occurs in `text`.
inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace duet::test
