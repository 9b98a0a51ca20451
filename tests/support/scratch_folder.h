// A folder for the files of one test.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include <stdlib.h>

namespace duet::test {

namespace fs = std::filesystem;

// A temporary folder that no other test shares. The destructor removes it with everything in it.
class ScratchFolder {
 public:
  // Throws std::runtime_error if the folder cannot be made.
  ScratchFolder() {
    std::string name = (fs::temp_directory_path() / "duet-test-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no scratch folder: " + name);
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  // Returns the path of the folder.
  const fs::path& path() const { return path_; }
  // Returns the path of a file in the folder.
  fs::path operator/(const std::string& name) const { return path_ / name; }

 private:
  fs::path path_;
};

}  // namespace duet::test
