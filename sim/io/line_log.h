// A file of JSON objects, one a line, that grows with a run: stats.jsonl, hashes.jsonl.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sim/base/file_hash.h"
#include "sim/io/run_directory.h"

namespace duet::io {

/// The frames of the lines of such a file's text, in their order. Lines that are torn or no objects are left
/// out.
std::vector<int> frames_of_lines(std::string_view text);

/// The first such line that is of `frame`; empty where there is none.
std::string line_of_frame(std::string_view text, int frame);

/// Appends lines; each is written whole or not at all.
class LineLog {
 public:
  /// Keeps the lines whose objects have a `frame` from 0 to `last_kept` (-1: none), drops all others. Throws
  /// FileError.
  LineLog(const RunDirectory& run, const fs::path& path, int last_kept);
  ~LineLog();
  LineLog(const LineLog&) = delete;
  LineLog& operator=(const LineLog&) = delete;

  bool is_empty() const;
  void append(const std::string& line);  ///< without the line's end; throws FileError
  void list() const;                     ///< what is there now, in the run's journal; throws FileError

 private:
  const RunDirectory run_;
  const fs::path path_;
  FileHash hash_;  // of the whole file
  int file_ = -1;
};

}  // namespace duet::io
