// A temporary folder.
#pragma once

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

#include <stdlib.h>

#include "sim/base/error.h"
#include "sim/base/files.h"

namespace duet {

/// A folder in the system's folder for temporary files that nothing else uses. The destructor removes it with
/// everything in it.
class ScratchFolder {
 public:
  /// Throws FileError if the folder cannot be made.
  ScratchFolder() {
    std::error_code missing;
    const std::filesystem::path folder = std::filesystem::temp_directory_path(missing);
    if (missing) {
      const char* chosen = std::getenv("TMPDIR");
      throw FileError(chosen != nullptr ? chosen : "/tmp",
                      "is no folder, and temporary files are to be in it",
                      "make it, or set TMPDIR to another folder");
    }
    std::string name = (folder / "duet-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw io::system_error(name, "cannot make a folder", errno);
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  /// Returns the path of the folder.
  const std::filesystem::path& path() const { return path_; }
  /// Returns the path of a file in the folder.
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

}  // namespace duet
