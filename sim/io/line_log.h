// Files of JSON objects, one on each line, that grow with a run: stats.jsonl and hashes.jsonl.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "sim/base/file_hash.h"
#include "sim/io/run_directory.h"

namespace duet::io {

/// Returns the number "frame" of each line of such a text, in the order of the lines. Lines that are torn,
/// hold no JSON object or have no possible frame are left out.
std::vector<int> frames_of_lines(std::string_view text);

/// Returns the first line of such a text whose "frame" is `frame`, with its line end; empty if there is
/// none.
std::string line_of_frame(std::string_view text, int frame);

/// An open file of JSON objects to which lines are appended. Each line is written whole or not at all.
class LineLog {
 public:
  /// Opens the file, or creates it. Keeps the lines whose "frame" lies between 0 and `last_kept` (-1: keeps
  /// none), drops all others, and lists the file in the run's journal. Throws FileError.
  LineLog(const RunDirectory& run, const fs::path& path, int last_kept);
  ~LineLog();
  LineLog(const LineLog&) = delete;
  LineLog& operator=(const LineLog&) = delete;

  /// Returns true if the file has no line.
  bool is_empty() const;
  /// Appends a line, which is given without its line end. Throws FileError.
  void append(const std::string& line);
  /// Lists the present length and hash of the file in the run's journal, if it has one. Throws FileError.
  void list() const;

 private:
  const RunDirectory run_;
  const fs::path path_;
  FileHash hash_;  // hash of the whole file so far
  int file_ = -1;  // descriptor, open to append
};

}  // namespace duet::io
