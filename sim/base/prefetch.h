// Requests for memory ahead of its use.
#pragma once

#include <cstddef>
#include <vector>

namespace duet {

/// Asks for the memory of entry `index` of each of `lists`, which a loop over them reads or writes soon; past
/// the end of a list it does nothing.
///
/// Processors ask by themselves for what comes next, but not beyond a page of memory (4 kB), and entries of a
/// kilobyte soon come to its end.
template <class... T>
void fetch_ahead(std::size_t index, const std::vector<T>&... lists) {
  constexpr std::size_t line = 64;  // bytes that come at once
  const auto fetch = [index](const auto& list) {
    if (index >= list.size()) return;
    const auto* begin = reinterpret_cast<const char*>(&list[index]);
    for (std::size_t i = 0; i < sizeof(list[index]); i += line) __builtin_prefetch(begin + i);
  };
  (fetch(lists), ...);
}

}  // namespace duet
