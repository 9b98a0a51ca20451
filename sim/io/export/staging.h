/// Where an export is written until it is whole.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

namespace duet::io {

namespace fs = std::filesystem;

/// A file or folder that takes its name once it is whole: until finish() it has another name beside the
/// target, and the destructor removes it.
class Staging {
 public:
  /// Removes what killed programs left of the target, too. Throws Error (usage) where the target is there and
  /// `overwrite` is not given, FileError where it cannot be written.
  Staging(const fs::path& target, bool overwrite, bool is_folder);
  ~Staging();
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  const fs::path& target() const { return target_; }
  /// What to write to meanwhile: an empty file, or an empty folder.
  const fs::path& path() const { return path_; }
  /// Gives it the target's name, in place of what has it. Throws FileError.
  void finish();

 private:
  const fs::path target_, path_;
  const bool overwrite_;
  bool is_finished_ = false;
  int held_ = -1;  // descriptor of what is written, locked: other programs leave it alone
};

/// A file that is written in pieces. All members throw FileError, close() also for what the system noticed
/// late.
class OutputFile {
 public:
  enum class Open { anew, to_append };
  explicit OutputFile(const fs::path& path, Open how = Open::anew);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::string_view bytes);
  template <class Value>
  void write_values(const std::vector<Value>& values) {
    write({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)});
  }
  std::uint64_t size() const { return size_; }  ///< bytes written by this object so far
  void close();

 private:
  void flush();

  const fs::path path_;
  int file_ = -1;
  std::uint64_t size_ = 0;
  std::vector<char> buffer_;
};

}  // namespace duet::io
