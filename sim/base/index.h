// Conversion of indices. Indices are int in the whole simulator, and -1 stands for none.
#pragma once

#include <cstddef>

#include "sim/base/assert.h"

namespace duet {

/// Converts a nonnegative index to the type by which containers are indexed.
constexpr std::size_t as_index(int i) {
  DUET_ASSERT(i >= 0);
  return static_cast<std::size_t>(i);
}

}  // namespace duet
