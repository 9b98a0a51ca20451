// Reading, writing and removing files with errors that name the path, the system's reason and a remedy.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/base/error.h"

namespace duet::io {

namespace fs = std::filesystem;

// The suffix of a file that is being written: "0003.obj.tmp4711" becomes "0003.obj" once it is whole. A
// killed program may leave one behind; remove_temporaries clears them away.
inline constexpr const char* temporary_mark = ".tmp";

// What the system says about `path`: "cannot write: No space left on device (free some space ...)".
FileError system_error(const fs::path& path, const std::string& action, int error_number);

// The whole file as bytes. Throws FileError.
std::string read_file(const fs::path& path);

// Writes `bytes` to a temporary name beside `path` and renames it: the file is whole or absent. Throws
// FileError.
void write_atomically(const fs::path& path, const std::string& bytes);
/// Hands over the file in pieces, until it ends or `take` returns false. Throws FileError.
void read_pieces(const fs::path& path, const std::function<bool(std::string_view)>& take);

/// Appends the line and its end to a file opened with O_APPEND: whole or not at all. Throws FileError.
void append_line(int file, const fs::path& path, std::string line);

// Creates the folder and its parents where they are missing. Throws FileError.
void create_folder(const fs::path& path);

// Removes the file if it is there. Throws FileError.
void remove_file(const fs::path& path);

/// Whether the file is there and not empty.
bool holds_bytes(const fs::path& path);

/// The paths of all that lies in the folder, in no order; a folder that is not there is empty. Throws
/// FileError where the folder cannot be read, which is not the same.
std::vector<fs::path> files_in(const fs::path& folder);

// Removes what an interrupted write left in `folder` (not in its subfolders); a missing folder is empty.
void remove_temporaries(const fs::path& folder);

// The number of a frame's file: 12 of "0012.obj" for the extension ".obj"; -1 for any other name and
// for numbers that no frame has.
int frame_of_file(const fs::path& path, const std::string& extension);

}  // namespace duet::io
