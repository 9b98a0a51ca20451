#include "sim/io/run_claim.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <ctime>
#include <map>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "sim/base/files.h"
#include "sim/io/json_text.h"

namespace duet::io {
namespace {

using Clock = std::chrono::steady_clock;
using Json = nlohmann::ordered_json;

std::chrono::nanoseconds duration(double seconds) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(seconds));
}

// Returns the time at which a process of this machine started, in clock ticks since boot; none if there is
// none. The name of its program, in parentheses, may contain blanks and parentheses.
std::optional<long long> start_of(long process) {
  std::string text;
  try {
    text = read_file(fmt::format("/proc/{}/stat", process));
  } catch (const FileError&) {
    return std::nullopt;
  }
  constexpr int fields_before = 19;  // between the parenthesis and `starttime`, the 22nd field: see proc(5)
  std::size_t at = text.rfind(')');
  if (at == std::string::npos || text.size() < at + 3 || text[at + 2] == 'Z')
    return std::nullopt;  // a zombie has ended
  ++at;
  for (int field = 0; field < fields_before && at != std::string::npos; ++field) at = text.find(' ', at + 1);
  long long start = 0;
  if (at == std::string::npos ||
      std::from_chars(text.data() + at + 1, text.data() + text.size(), start).ec != std::errc())
    return std::nullopt;
  return start;
}

std::string machine_id() {
  std::string boot;
  try {
    boot = read_file("/proc/sys/kernel/random/boot_id");
  } catch (const FileError&) {
  }
  while (!boot.empty() && boot.back() == '\n') boot.pop_back();
  std::error_code unknown;
  return boot + " " + fs::read_symlink("/proc/self/ns/pid", unknown).string();
}

std::string now_text() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  ::gmtime_r(&now, &utc);
  return fmt::format("{:04}-{:02}-{:02} {:02}:{:02}:{:02}", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday,
                     utc.tm_hour, utc.tm_min, utc.tm_sec);
}

Json to_json(const ProcessName& process) {
  return {{"host", process.host},
          {"machine", process.machine},
          {"process", process.process},
          {"start", process.start}};
}

std::optional<ProcessName> from_json(const Json& object) {
  try {
    const auto process = integer_of<long>(object.at("process"));
    const auto start = integer_of<long long>(object.at("start"));
    if (!process || !start) return std::nullopt;
    return ProcessName{object.at("host"), object.at("machine"), *process, *start};
  } catch (const Json::exception&) {
    return std::nullopt;
  }
}

std::string dump(const Json& object) { return object.dump(-1, ' ', false, Json::error_handler_t::replace); }

// State of the file of a claim. On NFS, opening a file asks the server, while its attributes may be old ones.
struct Seen {
  std::string text;
  std::int64_t touched = 0;  // time of the last change, ns
  bool operator==(const Seen&) const = default;
};

std::optional<Seen> look_at(const fs::path& file) {
  const int fd = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return std::nullopt;
  struct stat status {};
  const bool known = ::fstat(fd, &status) == 0;
  ::close(fd);
  if (!known) return std::nullopt;
  try {
    return Seen{read_file(file), status.st_mtim.tv_sec * 1'000'000'000LL + status.st_mtim.tv_nsec};
  } catch (const FileError&) {
    return std::nullopt;
  }
}

// Reads a claim. A file without a readable holder, which was not written to its end, has an unknown one.
ClaimHolder holder_in(const Seen& seen) {
  const Json object = parse_json<Json>(seen.text);
  if (!object.is_object()) return {{"an unknown machine", "", 0, 0}, "an unknown program", "an unknown time"};
  const auto process = from_json(object.value("holder", Json::object()));
  return {process.value_or(ProcessName{"an unknown machine", "", 0, 0}), text_in(object, "work"),
          text_in(object, "since")};
}

// Returns the claims in the folder by their numbers.
std::map<int, fs::path> claims_in(const fs::path& folder) {
  std::map<int, fs::path> claims;
  for (const fs::path& file : files_in(folder))
    if (const int number = frame_of_file(file, ".json"); number >= 0) claims[number] = file;
  return claims;
}

// Watches a claim of another machine. Returns true if its holder gives no sign of life; false if it gives
// one, or the claim is released.
bool is_silent(const fs::path& file, const Seen& first, const ClaimTimes& times) {
  const Clock::time_point end = Clock::now() + duration(times.silence);
  while (Clock::now() < end) {
    std::this_thread::sleep_for(duration(std::min(times.beat / 2, times.silence)));
    const std::optional<Seen> now = look_at(file);
    if (!now || !(*now == first)) return false;
  }
  return true;
}

// Gives the file `from` the name `to` unless that exists. Returns whether it succeeded, with the reason in
// errno. On NFS the answer of the server may get lost, so that the number of names decides.
bool take_name(const fs::path& from, const fs::path& to, const std::string& text) {
  if (::link(from.c_str(), to.c_str()) == 0) return true;
  const int reason = errno;
  struct stat status {};
  if (::stat(from.c_str(), &status) == 0 && status.st_nlink == 2) return true;
  errno = reason;
  if (reason != EPERM && reason != EOPNOTSUPP && reason != ENOSYS && reason != EMLINK) return false;
  const int fd = ::open(to.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (fd < 0) return false;
  const bool written = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  return ::close(fd) == 0 && written;
}

// Returns whether a claim is one of those in `stale`, as it was seen.
bool is_unchanged(const fs::path& file, const std::map<fs::path, Seen>& stale) {
  const auto found = stale.find(file);
  if (found == stale.end()) return false;
  const std::optional<Seen> now = look_at(file);
  return !now || *now == found->second;
}

// Returns the name of a file that no other process uses.
std::string candidate_name(const ProcessName& process) {
  static std::atomic<unsigned> count{0};
  std::string host = process.host;
  for (char& c : host)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  return fmt::format("candidate-{}-{}-{}-{}", host, process.process, process.start, count++);
}

}  // namespace

ProcessName this_process() {
  std::string host(256, '\0');
  if (::gethostname(host.data(), host.size() - 1) != 0) host = "unknown";
  host.resize(host.find('\0') == std::string::npos ? host.size() : host.find('\0'));
  const long process = ::getpid();
  return {host, machine_id(), process, start_of(process).value_or(0)};
}

Life life_of(const ProcessName& process) {
  if (process.machine != machine_id()) return Life::unknown;
  return start_of(process.process) == process.start ? Life::alive : Life::ended;
}

std::string process_json(const ProcessName& process) { return dump(to_json(process)); }

std::optional<ProcessName> read_process(const std::string& json) {
  const Json object = parse_json<Json>(json);
  return object.is_object() ? from_json(object) : std::nullopt;
}

std::string ClaimHolder::text() const {
  return fmt::format("{}, process {} on {}, since {} UTC", work, process.process, process.host, since);
}

RunClaim::RunClaim(const fs::path& root, const std::string& work, double wait, const ClaimTimes& times)
    : folder_(root / "claim"), times_(times) {
  const Clock::time_point end = Clock::now() + duration(std::min(wait, 1e9));
  while (const std::optional<ClaimHolder> holder = try_to_take(work)) {
    // Programs that only merge journals hold the claim for milliseconds.
    constexpr double moment = 10;  // s
    const bool is_short = holder->work.ends_with("journal");
    if (Clock::now() >= (is_short ? end + duration(moment) : end))
      throw FileError(root.string(), fmt::format("another program writes to this folder: {}", holder->text()),
                      "wait for it (--wait SECONDS), or choose another folder with --out");
    std::this_thread::sleep_for(std::chrono::milliseconds(is_short ? 20 : 500));
  }
  thread_ = std::thread([this] { beat(); });
}

RunClaim::~RunClaim() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    ending_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
  if (file_.empty()) return;
  ::unlink(file_.c_str());
  ::rmdir(folder_.c_str());  // fails while another program takes the claim
}

// Two programs may find the same claim stale. The link to the next number lets one of them win, unless a
// third one released the claim meanwhile, so that numbers began anew: a look at all claims after the link
// tells. A stale claim may have been removed by then, and a live one may have its number.
std::optional<ClaimHolder> RunClaim::try_to_take(const std::string& work) {
  constexpr int attempts =
      100;  // each fails only because another program took or released the claim meanwhile
  const ProcessName self = this_process();
  const std::string text =
      dump(Json{{"holder", to_json(self)}, {"work", work}, {"since", now_text()}}) + '\n';
  for (int attempt = 0; attempt < attempts; ++attempt) {
    create_folder(folder_);
    int last = 0;
    std::map<fs::path, Seen> stale;
    bool is_released = false;
    for (const auto& [number, file] : claims_in(folder_)) {
      const std::optional<Seen> seen = look_at(file);
      if (!seen) continue;
      const ClaimHolder holder = holder_in(*seen);
      const Life life = life_of(holder.process);
      if (life == Life::alive || (life == Life::unknown && !is_silent(file, *seen, times_))) {
        if (look_at(file)) return holder;
        is_released = true;
      }
      last = std::max(last, number);
      stale.emplace(file, *seen);
    }
    if (is_released) continue;
    const fs::path candidate = folder_ / candidate_name(self),
                   file = folder_ / fmt::format("{:04}.json", last + 1);
    try {
      write_atomically(candidate, text);
    } catch (const FileError&) {
      if (!fs::exists(folder_)) continue;  // its last holder has just removed it
      throw;
    }
    const bool is_taken = take_name(candidate, file, text);
    const int reason = errno;
    ::unlink(candidate.c_str());
    if (!is_taken && reason != EEXIST && reason != ENOENT) throw system_error(file, "cannot write", reason);
    if (!is_taken) continue;
    const auto claims = claims_in(folder_);
    const bool is_alone = std::all_of(claims.begin(), claims.end(), [&](const auto& claim) {
      return claim.second == file || is_unchanged(claim.second, stale);
    });
    if (is_alone) {
      for (const auto& [old, seen] : stale) ::unlink(old.c_str());
      file_ = file;
      return std::nullopt;
    }
    ::unlink(file.c_str());
    std::this_thread::sleep_for(std::chrono::milliseconds(1 + (self.process + attempt) % 17));
  }
  throw FileError(folder_.string(), "cannot be taken: many programs try to at the same time", "try it again");
}

void RunClaim::beat() {
  std::unique_lock lock(mutex_);
  while (!ending_.wait_for(lock, duration(times_.beat), [this] { return ended_; }))
    ::utimensat(AT_FDCWD, file_.c_str(), nullptr,
                0);  // a claim that was taken over is found by require_held()
}

void RunClaim::require_held() const {
  const int fd = ::open(file_.c_str(), O_RDONLY | O_CLOEXEC);
  const int reason = errno;
  if (fd >= 0) ::close(fd);
  if (fd < 0 && (reason == ENOENT || reason == ESTALE))
    throw FileError(
        folder_.parent_path().string(),
        "another program has taken the run over, because this one gave no sign of life for too long",
        "the other one continues it");
}

std::optional<ClaimHolder> RunClaim::holder(const fs::path& root) {
  for (const auto& [number, file] : claims_in(root / "claim"))
    if (const std::optional<Seen> seen = look_at(file))
      if (ClaimHolder holder = holder_in(*seen); life_of(holder.process) != Life::ended) return holder;
  return std::nullopt;
}

}  // namespace duet::io
