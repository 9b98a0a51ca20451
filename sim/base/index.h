// Indices are int, with -1 for none.
#pragma once

#include <cstddef>

namespace duet {

// What containers are indexed by.
constexpr std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

}  // namespace duet
