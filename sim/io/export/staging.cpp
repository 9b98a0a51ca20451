#include "sim/io/export/staging.h"

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include "sim/base/files.h"

namespace duet::io {
namespace {

// Bytes that an OutputFile gathers for a call of the system. A larger buffer would save few calls.
constexpr std::size_t buffer_bytes = 1 << 20;

// Opens the file or folder and locks it. The lock lasts until the descriptor is closed or the program ends,
// however it ends. Returns the descriptor; -1 if another program holds the lock or opening fails.
int hold(const fs::path& path, int flags) {
  const int file = ::open(path.c_str(), flags | O_CLOEXEC, 0666);
  // File systems without locks fail in other ways, which are ignored: the lock is only a safeguard.
  if (file < 0 || ::flock(file, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return file;
  ::close(file);
  return -1;
}

// Removes files and folders that killed programs left while they wrote this target: their names end in the
// number of a process, and no program holds them.
void remove_abandoned(const fs::path& target) {
  const std::string begin = target.filename().string() + temporary_mark;
  for (const fs::path& path : files_in(target.has_parent_path() ? target.parent_path() : ".")) {
    const std::string name = path.filename().string();
    if (!name.starts_with(begin) || name.size() == begin.size() ||
        name.find_first_not_of("0123456789", begin.size()) != std::string::npos)
      continue;
    const int file = hold(path, O_RDONLY);
    if (file < 0) continue;
    std::error_code none;
    fs::remove_all(path, none);
    ::close(file);
  }
}

}  // namespace

Staging::Staging(const fs::path& target, Kind kind, OldTarget old_target)
    : target_(target.filename().empty() ? target.parent_path() : target),
      path_(target_.string() + temporary_mark + std::to_string(::getpid())),
      old_target_(old_target) {
  const bool is_folder = kind == Kind::folder;
  if (old_target == OldTarget::is_kept && fs::exists(fs::symlink_status(target_)))
    throw Error(
        ExitStatus::usage,
        fmt::format(
            "{}: is there already, and stays untouched (give --overwrite to replace it, or another path "
            "with --out)",
            target_.string()));
  if (fs::exists(target_) && fs::is_directory(target_) != is_folder)
    throw Error(ExitStatus::usage,
                fmt::format("{}: the format writes a {}, and there is a {} (give another path with --out)",
                            target_.string(), is_folder ? "folder" : "file", is_folder ? "file" : "folder"));
  if (target_.has_parent_path()) create_folder(target_.parent_path());
  remove_abandoned(target_);
  if (is_folder) create_folder(path_);
  held_ = hold(path_, is_folder ? O_RDONLY | O_DIRECTORY : O_RDWR | O_CREAT);
  if (held_ < 0) throw system_error(path_, "cannot write", errno);
}

Staging::~Staging() {
  std::error_code none;
  if (!is_finished_) fs::remove_all(path_, none);
  if (held_ >= 0) ::close(held_);
}

void Staging::finish() {
  std::error_code error;
  // The system cannot replace a folder that has files in one call, so the old target is renamed first, and
  // removed last.
  const fs::path aside = target_.string() + temporary_mark + std::to_string(::getpid()) + "-before";
  const bool replaces = old_target_ == OldTarget::is_replaced && fs::exists(fs::symlink_status(target_));
  if (replaces) fs::rename(target_, aside, error);
  if (!error) fs::rename(path_, target_, error);
  if (error) {
    const std::error_code why = error;
    if (replaces && fs::exists(aside)) fs::rename(aside, target_, error);
    throw system_error(target_, "cannot write", why.value());
  }
  is_finished_ = true;
  if (replaces) fs::remove_all(aside, error);
}

OutputFile::OutputFile(const fs::path& path, Open how) : path_(path) {
  file_ =
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | (how == Open::anew ? O_TRUNC : O_APPEND), 0666);
  if (file_ < 0) throw system_error(path, "cannot write", errno);
  buffer_.reserve(buffer_bytes);
}

OutputFile::~OutputFile() {
  if (file_ >= 0) ::close(file_);
}

void OutputFile::write(std::string_view bytes) {
  size_ += bytes.size();
  while (!bytes.empty()) {
    const std::size_t part = std::min(bytes.size(), buffer_bytes - buffer_.size());
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(part));
    bytes.remove_prefix(part);
    if (buffer_.size() == buffer_bytes) flush();
  }
}

void OutputFile::flush() {
  const char* from = buffer_.data();
  for (std::size_t left = buffer_.size(); left > 0;) {
    const ssize_t written = ::write(file_, from, left);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw system_error(path_, "cannot write", errno);
    from += written;
    left -= static_cast<std::size_t>(written);
  }
  buffer_.clear();
}

void OutputFile::close() {
  flush();
  const int file = std::exchange(file_, -1);
  if (::close(file) != 0) throw system_error(path_, "cannot write", errno);
}

}  // namespace duet::io
