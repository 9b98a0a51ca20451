// Reading, writing and removing files, with errors that name the path, the system's reason and a remedy.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sim/base/error.h"

namespace duet::io {

/// The file system library of C++.
namespace fs = std::filesystem;

/// Text between the name of a file that is being written and the process id: "0003.obj.tmp4711-0" becomes
/// "0003.obj" once it is whole. A killed program may leave one behind; remove_temporaries() removes them.
inline constexpr const char* temporary_mark = ".tmp";

/// Returns a name beside `path` for a file that is being written: `path`, temporary_mark, the process id, "-"
/// and a number. It is unique among the threads and processes that may write at the same time.
fs::path temporary_name(const fs::path& path);
/// Returns whether the name is one that temporary_name() makes: it ends in temporary_mark, digits, "-" and
/// digits, and does not begin with them. Other names with temporary_mark in them, such as "notes.tmpl" and
/// "x.tmp", are those of the user's files.
bool is_temporary(const fs::path& path);

/// Returns the error for a failed system call on `path`, such as "cannot write: No space left on device (free
/// some space ...)". `action` is what was tried and `error_number` an errno value, to which a remedy is added
/// if one is known.
FileError system_error(const fs::path& path, const std::string& action, int error_number);

/// Returns the whole file as bytes. Throws FileError if it cannot be read or is not a regular file.
std::string read_file(const fs::path& path);

/// Returns the whole file as bytes; none if there is no such file, which another program may remove at any
/// moment. Otherwise as read_file().
std::optional<std::string> read_file_if_there(const fs::path& path);

/// Writes `bytes` to a temporary name beside `path` and renames that file, so that the file is whole or
/// absent. An existing file is replaced. Throws FileError; the temporary file is then removed.
void write_atomically(const fs::path& path, const std::string& bytes);
/// Passes the file to `take` in pieces of up to 256 KiB, until it ends or `take` returns false. Throws
/// FileError if it cannot be read or is not a regular file.
void read_pieces(const fs::path& path, const std::function<bool(std::string_view)>& take);

/// Appends `line` and a line end to a file descriptor that was opened with O_APPEND. The line is written as a
/// whole or not at all. `path` is used in messages only. Throws FileError.
void append_line(int file, const fs::path& path, std::string line);

/// Creates the folder and its missing parents. Throws FileError.
void create_folder(const fs::path& path);

/// Removes the file if it exists. Throws FileError if it cannot be removed.
void remove_file(const fs::path& path);

/// Returns whether the file exists and is not empty.
bool holds_bytes(const fs::path& path);

/// Returns the paths of all files and folders in the folder, in no particular order. A missing folder counts
/// as empty. Throws FileError if the folder exists and cannot be read.
std::vector<fs::path> files_in(const fs::path& folder);

/// Removes the temporary files that interrupted writes left in `folder`, not in its subfolders: files for
/// which is_temporary() holds. Files that the processes `writers` write, other files and folders stay, and
/// those of files with another name than `of` unless that is empty. A missing folder counts as empty. Throws
/// FileError.
void remove_temporaries(const fs::path& folder, const std::set<long>& writers = {},
                        const std::string& of = {});

/// Creates an empty file with a name that temporary_name() gives, and returns the name. No other program on
/// any machine gets the same one. Throws FileError.
fs::path create_temporary(const fs::path& path);

/// Returns the frame number in the name of a frame's file: 12 for "0012.obj" with the extension ".obj".
/// Returns -1 for any other name and for numbers above `max_frames`.
int frame_of_file(const fs::path& path, const std::string& extension);

}  // namespace duet::io
