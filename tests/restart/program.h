// Runs the program `duet` as a child process, as the shell of a user does.
#pragma once

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/places.h"
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "sim/base/scratch_folder.h"

namespace duet::test {

namespace fs = std::filesystem;

// A scene with a rigid and a soft body, whose frames take a few milliseconds.
inline const std::string tiny = source_folder() + "/tests/restart/tiny.toml";

// A child process with its standard output as a pipe and its standard error as a file. The destructor kills
// it if it still runs.
class Program {
 public:
  // Starts `program` with the arguments in the folder. Its standard output is a pipe of one page. A program
  // that prints a line per frame thus cannot run ahead of a test that does not read, and a signal always
  // meets it at work.
  explicit Program(const std::vector<std::string>& arguments, const fs::path& folder = source_folder(),
                   const std::string& program = duet_program()) {
    std::array<int, 2> pipe_ends{};
    errors_ = std::tmpfile();
    if (errors_ == nullptr || ::pipe2(pipe_ends.data(), O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    ::fcntl(pipe_ends[1], F_SETPIPE_SZ, 4096);
    std::vector<std::string> words = {program};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    argv.reserve(words.size() + 1);
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    child_ = ::fork();
    if (child_ == 0) {
      // Tests fill every mesh again, and leave nothing in the user's cache.
      ::setenv("DUET_CACHE", "off", 0);
      ::dup2(pipe_ends[1], STDOUT_FILENO);
      ::dup2(::fileno(errors_), STDERR_FILENO);
      if (::chdir(folder.c_str()) == 0) ::execv(argv[0], argv.data());
      ::_exit(127);
    }
    ::close(pipe_ends[1]);
    output_ = ::fdopen(pipe_ends[0], "r");
  }
  ~Program() {
    if (child_ > 0) {
      signal(SIGKILL);
      wait();
    }
    close_output();
    std::fclose(errors_);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  // Returns the next line of standard output without its end, or nothing once the program has closed it.
  std::optional<std::string> line() {
    std::string text;
    for (int c = std::fgetc(output_); c != EOF; c = std::fgetc(output_)) {
      if (c == '\n') return text;
      text += static_cast<char>(c);
    }
    return text.empty() ? std::nullopt : std::optional(text);
  }

  // Closes the reading end of the pipe, as a reader of the log that goes away.
  void close_output() {
    if (output_ != nullptr) std::fclose(std::exchange(output_, nullptr));
  }

  // Returns the processor time of the program since its start in s, or nothing once it has ended.
  std::optional<double> processor_time() const {
    clockid_t clock{};
    timespec used{};
    siginfo_t ended{};
    if (::waitid(P_PID, static_cast<id_t>(child_), &ended, WEXITED | WNOHANG | WNOWAIT) != 0 ||
        ended.si_pid != 0 || ::clock_getcpuclockid(child_, &clock) != 0 || ::clock_gettime(clock, &used) != 0)
      return std::nullopt;
    return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
  }
  // Waits until the program has computed for `seconds` more, or has ended. It has then come as far on a busy
  // machine as on a quiet one.
  void compute_for(double seconds) const {
    const std::optional<double> begin = processor_time();
    for (std::optional<double> now = begin; now && *now < *begin + seconds; now = processor_time())
      ::usleep(1000);
  }

  void signal(int number) const { ::kill(child_, number); }

  // Waits for the end. Returns the exit status, or 128 + signal as shells give it.
  int wait() {
    int status = 0;
    while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) continue;
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  // Returns the standard error so far.
  std::string errors() {
    std::rewind(errors_);
    std::string text;
    for (int c = std::fgetc(errors_); c != EOF; c = std::fgetc(errors_)) text += static_cast<char>(c);
    return text;
  }

 private:
  pid_t child_ = -1;
  FILE* output_ = nullptr;
  FILE* errors_ = nullptr;
};

// The outcome of a program that has ended.
struct Finished {
  int status = 0;
  std::vector<std::string> output;  // lines
  std::string errors;
  std::string last_line() const { return output.empty() ? std::string() : output.back(); }
};

inline Finished finish(Program& program) {
  Finished finished;
  while (const auto line = program.line()) finished.output.push_back(*line);
  finished.status = program.wait();
  finished.errors = program.errors();
  return finished;
}

inline Finished run_duet(const std::vector<std::string>& arguments,
                         const fs::path& folder = source_folder()) {
  Program program(arguments, folder);
  return finish(program);
}

}  // namespace duet::test
