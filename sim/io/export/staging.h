// Files of an export while they are written: a name beside the target until they are whole, and buffered
// writing.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

namespace duet::io {

namespace fs = std::filesystem;

/// A file or folder that takes the name of its target once it is whole. Until finish() it has another name
/// beside the target, "run.glb.tmpMACHINE-PROCESS-START", which no other process on any machine has, and the
/// destructor removes it. No lock of the file system is needed.
class Staging {
 public:
  /// What the target is.
  enum class Kind { file, folder };
  /// What happens to a target that is there already.
  enum class OldTarget {
    is_kept,     ///< The constructor throws.
    is_replaced  ///< finish() removes it.
  };

  /// Creates an empty file or folder beside the target. Removes files and folders that killed programs of
  /// this machine left beside this target. Throws Error (usage) if the target is there and is to be kept, or
  /// if it is a folder instead of a file or the other way round. Throws FileError if nothing can be written
  /// there.
  Staging(const fs::path& target, Kind kind, OldTarget old_target);
  /// Removes the file or folder unless it has been finished.
  ~Staging();
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  /// Returns the path of the target.
  const fs::path& target() const { return target_; }
  /// Returns the path to write to before finish().
  const fs::path& path() const { return path_; }
  /// Gives the file or folder the name of the target, whose old file or folder is removed. Throws
  /// FileError, and leaves the old target in place then.
  void finish();

 private:
  const fs::path target_, path_;
  const OldTarget old_target_;
  bool is_finished_ = false;
};

/// A file that is written in pieces, through a buffer.
class OutputFile {
 public:
  /// Position at which writing begins in an existing file.
  enum class Open {
    anew,      ///< the file is emptied first
    to_append  ///< writing goes on at its end
  };
  /// Opens the file, or creates it. Throws FileError.
  explicit OutputFile(const fs::path& path, Open how = Open::anew);
  /// Closes the file without writing what is still in the buffer, if close() was not called.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Writes bytes. Throws FileError.
  void write(std::string_view bytes);
  /// Writes the values as they lie in memory. Throws FileError.
  template <class Value>
  void write_values(const std::vector<Value>& values) {
    write({reinterpret_cast<const char*>(values.data()), values.size() * sizeof(Value)});
  }
  /// Returns the number of bytes that this object was given to write so far.
  std::uint64_t size() const { return size_; }
  /// Writes the rest of the buffer and closes the file. Throws FileError, also for errors that the system
  /// reports only now, as for a full disk on a network.
  void close();

 private:
  void flush();  // writes the buffer and empties it

  const fs::path path_;
  int file_ = -1;
  std::uint64_t size_ = 0;
  std::vector<char> buffer_;
};

}  // namespace duet::io
