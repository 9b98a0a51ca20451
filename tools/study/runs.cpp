#include "tools/study/runs.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "tools/interrupt.h"
#include "tools/scene_files.h"
#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <sched.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "sim/base/files.h"
#include "sim/base/hash.h"
#include "sim/io/checkpoint.h"
#include "sim/io/json_text.h"
#include "sim/io/run_claim.h"
#include "sim/io/run_directory.h"
#include "sim/scene/plan.h"

namespace duet::study {
namespace {

using Clock = std::chrono::steady_clock;

// Returns the last processor that this process may use, because the first ones serve most interrupts; -1 if
// it cannot be found out.
int last_processor() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (::sched_getaffinity(0, sizeof allowed, &allowed) != 0) return -1;
  for (int i = CPU_SETSIZE - 1; i >= 0; --i)
    if (CPU_ISSET(i, &allowed)) return i;
  return -1;
}

// Binds this thread, and the children that it starts, to one processor while it lives. A negative number
// binds to none.
class Pinned {
 public:
  explicit Pinned(int processor)
      : bound_(processor >= 0 && ::sched_getaffinity(0, sizeof before_, &before_) == 0) {
    cpu_set_t one;
    CPU_ZERO(&one);
    if (!bound_) return;
    CPU_SET(processor, &one);
    bound_ = ::sched_setaffinity(0, sizeof one, &one) == 0;
  }
  ~Pinned() {
    if (bound_) ::sched_setaffinity(0, sizeof before_, &before_);
  }
  Pinned(const Pinned&) = delete;
  Pinned& operator=(const Pinned&) = delete;

 private:
  cpu_set_t before_;
  bool bound_;
};

fs::path outcome_file(const Run& run) { return run.folder.string() + ".outcome.json"; }
fs::path log_file(const Run& run) { return run.folder.string() + ".log"; }

// Returns a hash of everything that decides what the program computes. A portable program is a launcher of
// programs in a folder beside it, one of which DUET_ISA may name.
std::uint64_t hash_of_program(const fs::path& program) {
  std::vector<fs::path> files = {program};
  std::error_code missing;
  const fs::path folder = fs::canonical(program, missing).parent_path();
  for (const fs::path& place : {folder / "libexec/duet", folder.parent_path() / "libexec/duet"})
    for (const fs::directory_entry& entry : fs::directory_iterator(place, missing))
      files.push_back(entry.path());
  std::sort(files.begin() + 1, files.end());
  const char* isa = std::getenv("DUET_ISA");
  std::uint64_t hash = isa != nullptr ? hash_bytes(isa, std::strlen(isa)) : hash_seed;
  for (const fs::path& file : files) {
    const std::string bytes = io::read_file(file);
    hash = hash_bytes(bytes.data(), bytes.size(), hash);
  }
  return hash;
}

// Returns the last error in the output of `duet sim --json`; empty if there is none.
std::string error_in_log(const fs::path& log) {
  const std::string text = io::read_file(log);
  std::string error;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const nlohmann::json line = io::parse_json(std::string_view(text).substr(begin, end - begin));
    if (line.is_object() && line.contains("error")) error = io::text_in(line, "error");
    begin = end + 1;
  }
  return error;
}

}  // namespace

// A running process.
struct Runner::Child {
  Run* run;
  pid_t process;
  int handle;  // pidfd, for poll()
  // Time at which it is ended.
  Clock::time_point due;
};

Runner::Runner(fs::path folder, fs::path program, int jobs, tools::Report& report)
    : folder_(std::move(folder)),
      program_(program.empty() ? fs::path("/proc/self/exe") : std::move(program)),
      jobs_(jobs),
      processor_(last_processor()),
      report_(report) {
  program_hash_ = hash_of_program(program_);
}

void Runner::identify(Run& run) const {
  const scene::ReadResult read = tools::read_scene(run.scene);
  const EffectSet effects = scene::plan_effects(read.scene, run.scene.without).active();
  std::uint64_t key = io::scene_identity(read.source, effects) ^ read.meshes;
  for (const std::uint64_t part : {program_hash_, static_cast<std::uint64_t>(run.frames)})
    key = hash_bytes(&part, sizeof part, key);
  run.folder = folder_ / fmt::format("{:016x}-{}{}", key, run.timed ? "" : "untimed-", run.repetition);
}

bool Runner::finished(Run& run) const {
  const fs::path file = outcome_file(run);
  if (!fs::exists(file)) return false;
  const nlohmann::json outcome = io::parse_json(io::read_file(file));
  if (!outcome.is_object()) return false;
  run.failed = outcome.value("status", nlohmann::json()) != 0;
  run.error = io::text_in(outcome, "error");
  return run.failed || fs::exists(io::RunDirectory{run.folder}.stats());
}

Runner::Child Runner::start(Run& run) const {
  if (const auto holder = io::RunClaim::holder(run.folder))
    throw FileError(run.folder.string(), "another program writes to this folder: " + holder->text(),
                    "wait for it");
  fs::remove_all(run.folder);  // a study that was stopped may have left it
  std::vector<std::string> words = {program_.string(),
                                    "sim",
                                    tools::find_scene(run.scene.name).string(),
                                    "--out",
                                    run.folder.string(),
                                    "--frames",
                                    std::to_string(run.frames),
                                    "--threads",
                                    "1",
                                    "--stats-only",
                                    "--json"};
  const auto add = [&](const char* option, const std::vector<std::string>& values) {
    for (const std::string& value : values) words.insert(words.end(), {option, value});
  };
  add("--set", run.scene.set);
  add("--without", run.scene.without);
  std::vector<char*> argv;
  argv.reserve(words.size() + 1);
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);

  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  const std::string log = log_file(run).string();
  ::posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
  ::posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  pid_t process = -1;
  int failure = 0;
  {
    const Pinned pinned(run.timed ? processor_ : -1);
    failure = ::posix_spawn(&process, program_.c_str(), &files, nullptr, argv.data(), ::environ);
  }
  ::posix_spawn_file_actions_destroy(&files);
  // glibc 2.36 declares pidfd_open() for C alone.
  const int handle = failure == 0 ? static_cast<int>(::syscall(SYS_pidfd_open, process, 0)) : -1;
  if (handle < 0) throw io::system_error(program_, "cannot run", failure != 0 ? failure : errno);
  return {
      &run, process, handle,
      Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(run.limit))};
}

void Runner::conclude(Run& run, int status, bool overdue) const {
  run.failed = status != 0;
  run.error.clear();
  if (overdue)
    run.error = fmt::format("stopped after the time limit of {:.6g} s", run.limit);
  else if (WIFSIGNALED(status))
    run.error =
        fmt::format("the program was ended by signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)));
  else if (run.failed)
    run.error = error_in_log(log_file(run));
  const nlohmann::ordered_json outcome = {{"status", status}, {"error", run.error}};
  io::write_atomically(outcome_file(run),
                       outcome.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + '\n');
}

// An interrupt is passed on to the children, which then end. Their runs are not concluded, and start again
// next time.
bool Runner::carry_out_together(const std::vector<Run*>& runs, std::size_t at_once) {
  std::vector<Child> children;
  std::size_t next = 0;
  bool stopping = false;
  while (next < runs.size() || !children.empty()) {
    stopping |= tools::interrupted();
    while (!stopping && next < runs.size() && children.size() < at_once)
      children.push_back(start(*runs[next++]));
    if (children.empty()) break;
    std::vector<pollfd> handles;
    Clock::time_point first_due = Clock::time_point::max();
    for (const Child& child : children) {
      handles.push_back({child.handle, POLLIN, 0});
      first_due = std::min(first_due, child.due);
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(first_due - Clock::now()).count();
    const int ready =
        ::poll(handles.data(), handles.size(), static_cast<int>(std::clamp<long long>(left, 0, 1 << 30)));
    if (ready < 0 && errno != EINTR) throw io::system_error(program_, "cannot wait for", errno);
    if (tools::interrupted() && !stopping)
      for (const Child& child : children) ::kill(child.process, SIGTERM);
    stopping |= tools::interrupted();

    for (std::size_t i = children.size(); i-- > 0;) {
      const bool overdue = Clock::now() >= children[i].due;
      if (overdue) ::kill(children[i].process, SIGKILL);
      if (!overdue && (ready <= 0 || handles[i].revents == 0)) continue;
      int status = 0;
      ::waitpid(children[i].process, &status, 0);
      ::close(children[i].handle);
      const bool interrupted =
          WIFEXITED(status) && WEXITSTATUS(status) == static_cast<int>(ExitStatus::interrupted);
      if (!interrupted && !stopping) {
        conclude(*children[i].run, status, overdue);
        report_.note(fmt::format("run {} of {}{}", ++simulated_, to_simulate_,
                                 children[i].run->failed ? " failed: " + children[i].run->error : ""));
      }
      stopping |= interrupted;
      children.erase(children.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  return !stopping;
}

std::vector<Run*> Runner::distinct(std::vector<Run*>& runs) const {
  for (Run* run : runs) identify(*run);
  std::vector<Run*> list;
  for (const bool is_timed : {false, true})
    for (Run* run : runs) {
      const bool twice =
          std::any_of(list.begin(), list.end(), [&](const Run* r) { return r->folder == run->folder; });
      if (run->timed == is_timed && !twice) list.push_back(run);
    }
  return list;
}

int Runner::with_result(std::vector<Run*>& runs) const {
  const std::vector<Run*> list = distinct(runs);
  return static_cast<int>(std::count_if(list.begin(), list.end(), [&](Run* run) { return finished(*run); }));
}

bool Runner::carry_out_point(std::vector<Run*>& runs, int point) {
  io::create_folder(folder_);
  const std::vector<Run*> list = distinct(runs);
  if (point > static_cast<int>(list.size()))
    throw Error(ExitStatus::usage, fmt::format("--point {}: the study has {} runs", point, list.size()));
  Run* run = list[static_cast<std::size_t>(point - 1)];
  if (finished(*run)) return true;
  to_simulate_ = 1;
  return carry_out_together({run}, 1);
}

bool Runner::carry_out(std::vector<Run*>& runs) {
  io::create_folder(folder_);
  std::vector<Run*> untimed, timed;
  for (Run* run : distinct(runs))
    if (!finished(*run)) (run->timed ? timed : untimed).push_back(run);
  to_simulate_ = simulated_ + static_cast<int>(untimed.size() + timed.size());
  const bool whole =
      carry_out_together(untimed, static_cast<std::size_t>(jobs_)) && carry_out_together(timed, 1);
  if (!whole) return false;
  for (Run* run : runs) finished(*run);  // includes runs that share a folder with another one
  return true;
}

}  // namespace duet::study
