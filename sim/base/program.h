// Runs another program and waits for it.
#pragma once

#include <atomic>
#include <filesystem>
#include <string>
#include <vector>

namespace duet {

/// How a started program ended.
struct ProgramEnd {
  int start_error = 0;  ///< errno of the start; 0 if the program ran
  int status = 0;       ///< exit status; 128 + n after signal n
  std::string words;    ///< text that it wrote to standard error
};

/// Runs a program in `folder` to its end, or until `*stop` becomes true.
///
/// `words` are its name, which is looked up in PATH, and its arguments, which no shell reads. Its standard
/// input and output are /dev/null. `stop` may be null.
ProgramEnd run_program(const std::vector<std::string>& words, const std::filesystem::path& folder,
                       const std::atomic<bool>* stop);

/// Returns the last line of a text, without the end of the line.
std::string last_line(std::string text);

}  // namespace duet
