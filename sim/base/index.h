// Indices are int, with -1 for none.
#pragma once

#include <cstddef>

#include "sim/base/assert.h"

namespace duet {

/// Returns the index `i`, which is not -1, as containers take it.
constexpr std::size_t as_index(int i) {
  DUET_ASSERT(i >= 0);
  return static_cast<std::size_t>(i);
}

}  // namespace duet
