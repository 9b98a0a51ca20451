#include "sim/io/export/staging.h"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "sim/base/files.h"
#include "sim/base/hash.h"
#include "sim/io/run_claim.h"

namespace duet::io {
namespace {

// Bytes that an OutputFile gathers for a call of the system. A larger buffer would save few calls.
constexpr std::size_t buffer_bytes = 1 << 20;

// Returns what tells the files of this process from those of all others, also on other machines that share
// the folder: "MACHINE-PROCESS-START".
std::string own_mark() {
  const ProcessName self = this_process();
  return fmt::format("{:016x}-{}-{}", hash_bytes(self.machine.data(), self.machine.size()), self.process,
                     self.start);
}

// Reads a mark. Returns the process if it is one of this machine; none for others, and for any other text.
std::optional<ProcessName> process_in(const std::string& mark) {
  ProcessName process = this_process();
  const std::string machine =
      fmt::format("{:016x}-", hash_bytes(process.machine.data(), process.machine.size()));
  if (!mark.starts_with(machine)) return std::nullopt;
  const char* end = mark.data() + mark.size();
  const auto number = std::from_chars(mark.data() + machine.size(), end, process.process);
  if (number.ec != std::errc() || number.ptr == end || *number.ptr != '-') return std::nullopt;
  const auto start = std::from_chars(number.ptr + 1, end, process.start);
  if (start.ec != std::errc() || start.ptr != end) return std::nullopt;
  return process;
}

// Removes files and folders that killed programs left while they wrote this target. Those of programs on
// other machines, of which this one cannot tell whether they live, stay.
void remove_abandoned(const fs::path& target) {
  const std::string begin = target.filename().string() + temporary_mark;
  for (const fs::path& path : files_in(target.has_parent_path() ? target.parent_path() : ".")) {
    const std::string name = path.filename().string();
    if (!name.starts_with(begin)) continue;
    const std::optional<ProcessName> writer = process_in(name.substr(begin.size()));
    if (!writer || life_of(*writer) != Life::ended) continue;
    std::error_code none;
    fs::remove_all(path, none);
  }
}

}  // namespace

Staging::Staging(const fs::path& target, Kind kind, OldTarget old_target)
    : target_(target.filename().empty() ? target.parent_path() : target),
      path_(target_.string() + temporary_mark + own_mark()),
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
  if (is_folder)
    create_folder(path_);
  else
    OutputFile(path_).close();
}

Staging::~Staging() {
  std::error_code none;
  if (!is_finished_) fs::remove_all(path_, none);
}

void Staging::finish() {
  std::error_code error;
  // The system cannot replace a folder that has files in one call, so the old target is renamed first, and
  // removed last.
  const fs::path aside = path_.string() + "-before";
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
