// Looking at texts that a program has written.
#pragma once

#include <string>

namespace duet::test {

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace duet::test
