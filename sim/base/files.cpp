#include "sim/base/files.h"

#include <atomic>
#include <cerrno>
#include <charconv>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "sim/base/frame_limits.h"

namespace duet::io {
namespace {

// Returns advice for an errno value; empty if there is none.
std::string remedy_for(int error_number) {
  switch (error_number) {
    case ENOSPC:
    case EDQUOT:
      return "free some space there, or choose a folder on another disk with --out";
    case EROFS:
      return "choose a writable folder with --out";
    case EACCES:
    case EPERM:
      return "check the permissions of the folder, or choose another one with --out";
    case EFBIG:
      return "raise the limit on the size of files (ulimit -f)";
    case EMFILE:
    case ENFILE:
      return "raise the limit on open files (ulimit -n)";
    case ENOENT:
      return "check the path";
    case EISDIR:
      return "give the path of a file";
    case EIO:
      return "the disk or its connection fails: copy the file from another place";
    case ENOTDIR:
      return "a part of the path is a file, not a folder: choose another path";
    default:
      return {};
  }
}

// A file descriptor that is closed at the end of its scope.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  // Closes the descriptor and returns whether that succeeded. Some file systems report a full disk only here.
  bool close() { return ::close(std::exchange(fd_, -1)) == 0; }

 private:
  int fd_;
};

// Writes all bytes. Returns false on failure, with the reason in errno.
bool write_all(int fd, const std::string& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t n = ::write(fd, bytes.data() + done, bytes.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return true;
}

// Bound on the number of temporary names that are tried for one path. Each existing one was left by a killed
// program with the same process id.
constexpr int max_left = 10'000;

// Opens a new file with a name that temporary_name() gives. Returns the name and the descriptor, which is
// negative on failure, with the reason in errno. Process ids repeat in containers and on other machines, so
// that a killed program may have left files of this name, or a program elsewhere writes one.
std::pair<fs::path, int> open_temporary(const fs::path& path) {
  fs::path temporary;
  int created = -1;
  for (int left = 0; left <= max_left; ++left) {
    temporary = temporary_name(path);
    created = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (created >= 0 || errno != EEXIST) break;
  }
  return {temporary, created};
}

// Returns the number of the process in a name that temporary_name() gives; -1 for other names.
long process_of(const fs::path& path) {
  const std::string name = path.filename().string();
  const std::size_t mark = name.rfind(temporary_mark);
  long process = -1;
  if (mark != std::string::npos)
    std::from_chars(name.data() + mark + std::string_view(temporary_mark).size(), name.data() + name.size(),
                    process);
  return process;
}

// Removes the digits at the end of the text and returns whether there were any.
bool take_digits(std::string_view& text) {
  const std::size_t size = text.find_last_not_of("0123456789") + 1;  // 0: all are digits
  const bool found = size < text.size();
  text = text.substr(0, size);
  return found;
}

// Removes `end` from the end of the text and returns whether it was there.
bool take_end(std::string_view& text, std::string_view end) {
  if (!text.ends_with(end)) return false;
  text.remove_suffix(end.size());
  return true;
}

// Opens a file. Without O_NONBLOCK, opening a pipe would wait for a writer.
int open_to_read(const fs::path& path) { return ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC); }

// Returns the size of an open file. Throws FileError if the descriptor is not open or is not that of a
// regular file.
off_t size_of(int file, const fs::path& path) {
  struct stat status {};
  if (file < 0 || ::fstat(file, &status) != 0) throw system_error(path, "cannot read", errno);
  if (S_ISDIR(status.st_mode)) throw system_error(path, "cannot read", EISDIR);
  if (!S_ISREG(status.st_mode))
    throw FileError(path.string(), "cannot read: it is a pipe, a device or a socket",
                    "give the path of a file; what a pipe delivers can be saved to one first");
  return status.st_size;
}

// Reads up to `most` bytes and returns how many were read; 0 at the end. Throws FileError.
std::size_t read_some(int file, const fs::path& path, char* bytes, std::size_t most) {
  while (true) {
    const ssize_t n = ::read(file, bytes, most);
    if (n >= 0) return static_cast<std::size_t>(n);
    if (errno != EINTR) throw system_error(path, "cannot read", errno);
  }
}

}  // namespace

FileError system_error(const fs::path& path, const std::string& action, int error_number) {
  return {path.string(), fmt::format("{}: {}", action, std::generic_category().message(error_number)),
          remedy_for(error_number)};
}

fs::path temporary_name(const fs::path& path) {
  static std::atomic<unsigned> count{0};
  return fmt::format("{}{}{}-{}", path.string(), temporary_mark, ::getpid(), count++);
}

bool is_temporary(const fs::path& path) {
  const std::string name = path.filename().string();
  std::string_view rest = name;
  return take_digits(rest) && take_end(rest, "-") && take_digits(rest) && take_end(rest, temporary_mark) &&
         !rest.empty();
}

fs::path create_temporary(const fs::path& path) {
  const auto [temporary, created] = open_temporary(path);
  if (created < 0) throw system_error(path, "cannot write", errno);
  ::close(created);
  return temporary;
}

void write_atomically(const fs::path& path, const std::string& bytes) {
  const auto [temporary, created] = open_temporary(path);
  Descriptor file(created);
  if (file.get() < 0) throw system_error(path, "cannot write", errno);
  if (write_all(file.get(), bytes) && file.close() && ::rename(temporary.c_str(), path.c_str()) == 0) return;
  const int reason = errno;
  ::unlink(temporary.c_str());
  throw system_error(path, "cannot write", reason);
}

std::string read_file(const fs::path& path) {
  std::optional<std::string> bytes = read_file_if_there(path);
  if (!bytes) throw system_error(path, "cannot read", ENOENT);
  return *std::move(bytes);
}

std::optional<std::string> read_file_if_there(const fs::path& path) {
  const Descriptor file(open_to_read(path));
  if (file.get() < 0 && (errno == ENOENT || errno == ENOTDIR)) return std::nullopt;
  std::string bytes(static_cast<std::size_t>(size_of(file.get(), path)), '\0');
  std::size_t done = 0;
  while (true) {
    if (done == bytes.size())
      // The end is reached, or the file states no size, as in /proc.
      bytes.resize(bytes.size() + 4096);
    const std::size_t n = read_some(file.get(), path, bytes.data() + done, bytes.size() - done);
    if (n == 0) break;
    done += n;
  }
  bytes.resize(done);
  return bytes;
}

void read_pieces(const fs::path& path, const std::function<bool(std::string_view)>& take) {
  const Descriptor file(open_to_read(path));
  size_of(file.get(), path);
  std::string piece(1 << 18, '\0');  // 256 KiB fit in the cache of a core
  while (const std::size_t n = read_some(file.get(), path, piece.data(), piece.size()))
    if (!take(std::string_view(piece).substr(0, n))) return;
}

void append_line(int file, const fs::path& path, std::string line) {
  line += '\n';
  const off_t before = ::lseek(file, 0, SEEK_END);
  // The whole line is written in one call, so that neither a reader nor a kill between two calls meets half
  // of it.
  const ssize_t written = ::write(file, line.data(), line.size());
  if (written == static_cast<ssize_t>(line.size())) return;
  // A short write means that the file cannot grow. A second attempt gets the reason from the system.
  int reason = errno;
  if (written >= 0) {
    const auto done = static_cast<std::size_t>(written);
    reason = ::write(file, line.data() + done, line.size() - done) < 0 ? errno : EIO;
  }
  if (::ftruncate(file, before) != 0) reason = errno;
  throw system_error(path, "cannot write", reason);
}

void create_folder(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error) throw system_error(path, "cannot create the folder", error.value());
}

void remove_file(const fs::path& path) {
  std::error_code error;
  fs::remove(path, error);
  if (error) throw system_error(path, "cannot remove", error.value());
}

bool holds_bytes(const fs::path& path) {
  std::error_code missing;
  const std::uintmax_t size = fs::file_size(path, missing);
  return !missing && size > 0;
}

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    files.push_back(entry->path());
  if (error && error != std::errc::no_such_file_or_directory)
    throw system_error(folder, "cannot read the folder", error.value());
  return files;
}

void remove_temporaries(const fs::path& folder, const std::set<long>& writers, const std::string& of) {
  for (const fs::path& path : files_in(folder))
    if (std::error_code error; is_temporary(path) && !writers.contains(process_of(path)) &&
                               (of.empty() || path.filename().string().starts_with(of + temporary_mark)) &&
                               !fs::is_directory(path, error))
      remove_file(path);
}

int frame_of_file(const fs::path& path, const std::string& extension) {
  const std::string stem = path.stem().string();
  if (path.extension() != extension || stem.size() < 4) return -1;
  int frame = -1;
  const char* end = stem.data() + stem.size();
  const auto [rest, error] = std::from_chars(stem.data(), end, frame);
  return error == std::errc() && rest == end && frame >= 0 && frame <= max_frames ? frame : -1;
}

}  // namespace duet::io
