// Wall-clock seconds and calls of every stage; measured always.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>

#include "sim/step/stage_table.h"

namespace duet {

/// Sums of the seconds and calls of every stage.
class StageClock {
 public:
  /// The sums of one stage.
  struct Entry {
    double seconds = 0;      ///< s, wall-clock time
    std::int64_t calls = 0;  ///< number of calls
  };
  /// Returns the sums of `stage` since the last reset().
  const Entry& operator[](Stage stage) const { return entries_[static_cast<std::size_t>(stage)]; }
  /// Sets all sums to zero.
  void reset() { entries_ = {}; }

  /// Runs `work()` as one call of `stage`, and adds its duration.
  template <class Work>
  void time(Stage stage, Work&& work) {
    const auto start = std::chrono::steady_clock::now();
    work();
    Entry& entry = entries_[static_cast<std::size_t>(stage)];
    entry.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    ++entry.calls;
  }

 private:
  std::array<Entry, stage_count> entries_{};  // by Stage
};

}  // namespace duet
