// stats.jsonl: one JSON object a frame, one line each.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "sim/io/line_log.h"

namespace duet::io {

// The object of one frame, on one line, without the line's end. Fields in the order of FrameStats; stages as
// {name: {seconds, calls}}; the hash as 16 hexadecimal digits, because JSON numbers do not carry 64 bits
// everywhere.
std::string stats_json(const FrameStats& stats);

/// The hash of the state that the statistics of `run` tell of a frame; nothing where they lack the frame or
/// its hash. Throws FileError where they cannot be read.
std::optional<std::uint64_t> recorded_hash(const RunDirectory& run, int frame);

// Appends lines to stats.jsonl; each is written whole or not at all, and listed in the run's journal.
class StatsLog {
 public:
  // Keeps the lines of frames up to `last_kept` that are there (-1: none), drops all others. Throws
  // FileError.
  explicit StatsLog(const RunDirectory& run, int last_kept = -1);

  void append(const FrameStats& stats);  // throws FileError

 private:
  LineLog lines_;
};

}  // namespace duet::io
