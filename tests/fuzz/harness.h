// What the harnesses for libFuzzer share: the contract of a reader, and files in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <string>
#include <string_view>

#include <unistd.h>

#include "sim/base/error.h"
#include "sim/base/files.h"

namespace duet::fuzz {

namespace fs = std::filesystem;

// Bound on the processor seconds that one input may take. Readers may take 1 s for inputs below 64 kB;
// sanitizers and counters of coverage make them slower, at most by this factor on what was measured.
inline constexpr double max_seconds = 5;

// Prints the sentence and ends the program by abort(), which libFuzzer takes for a finding.
[[noreturn]] inline void report_finding(const std::string& what) {
  std::fprintf(stderr, "FINDING: %s\n", what.c_str());
  std::abort();
}

// Calls read(), and returns whether it returned without an error. The contract: it may throw a duet::Error
// with a message. Other exceptions pass through, as libFuzzer takes them for findings. No message, or more
// than `most_seconds` of processor time, are findings, too.
template <class Read>
bool is_accepted(Read&& read, double most_seconds = max_seconds) {
  const std::clock_t start = std::clock();
  bool accepted = true;
  try {
    read();
  } catch (const Error& error) {
    if (*error.what() == '\0') report_finding("an error has no message");
    accepted = false;
  }
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  if (seconds > most_seconds)
    report_finding("the input takes " + std::to_string(seconds) + " s of processor time");
  return accepted;
}

// Returns the input as text.
inline std::string text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

// Returns a folder of this process below TMPDIR, which tools/fuzz sets to a folder in memory.
inline const fs::path& memory_folder() {
  static const fs::path folder = [] {
    const fs::path path = fs::temp_directory_path() / ("duet-fuzz-" + std::to_string(::getpid()));
    fs::create_directories(path);
    return path;
  }();
  return folder;
}

// Writes the bytes to a file of memory_folder(), whose parents it creates, and returns the path.
inline fs::path write_file(const std::string& name, std::string_view bytes) {
  const fs::path path = memory_folder() / name;
  fs::create_directories(path.parent_path());
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (!file || std::fwrite(bytes.data(), 1, bytes.size(), file) != bytes.size() || std::fclose(file) != 0) {
    std::perror(path.c_str());
    std::_Exit(2);  // no finding: the memory folder is full
  }
  return path;
}

}  // namespace duet::fuzz

// Called by libFuzzer for every input. Returns 0.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
