// Seconds and calls of every stage, always on.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>

#include "sim/step/stage_table.h"

namespace duet {

class StageClock {
 public:
  struct Entry {
    double seconds = 0;
    std::int64_t calls = 0;
  };
  const Entry& operator[](Stage stage) const { return entries_[static_cast<std::size_t>(stage)]; }
  void reset() { entries_ = {}; }

  /// Runs `work` as one call of `stage`.
  template <class Work>
  void time(Stage stage, Work&& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    Entry& entry = entries_[static_cast<std::size_t>(stage)];
    entry.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    ++entry.calls;
  }

 private:
  std::array<Entry, stage_count> entries_{};
};

}  // namespace duet
