// stats.jsonl: the statistics of a run, one JSON object on each line for a frame.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "sim/io/line_log.h"

namespace duet::io {

/// Returns the JSON object of one frame on one line, without the line end. Stages are {name: {seconds,
/// calls}}. The hash is a text of 16 hexadecimal digits, because many readers of JSON hold numbers as
/// doubles. The ledger, pinched bodies and self-intersections are left out if the frame has none.
std::string stats_json(const FrameStats& stats);

/// Returns the hash of the state that stats.jsonl of the run holds for a frame; none if the file, the frame
/// or its hash is missing. Throws FileError if the file cannot be read.
std::optional<std::uint64_t> recorded_hash(const RunDirectory& run, int frame);

/// Writes stats.jsonl. Each line is written whole or not at all, and listed in the run's journal.
class StatsLog {
 public:
  /// Opens stats.jsonl. Keeps its lines of frames up to `last_kept` (-1: none) and drops all others. Throws
  /// FileError.
  explicit StatsLog(const RunDirectory& run, int last_kept = -1);

  /// Appends the line of a frame. Throws FileError.
  void append(const FrameStats& stats);

 private:
  LineLog lines_;
};

}  // namespace duet::io
