#include "sim/base/program.h"

#include <array>
#include <cerrno>
#include <csignal>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace duet {
namespace {

// Reads from a pipe until its other end is closed, and returns the text. Ends the child soon after `*stop`
// becomes true.
std::string words_of(pid_t child, int pipe, const std::atomic<bool>* stop) {
  constexpr int look = 100;  // ms between two looks at `stop`: a larger value delays the end
  std::string words;
  std::array<char, 1024> piece{};
  while (true) {
    pollfd ready{pipe, POLLIN, 0};
    if (stop != nullptr && *stop) kill(child, SIGKILL);
    const int state = poll(&ready, 1, stop != nullptr ? look : -1);
    if (state == 0 || (state < 0 && errno == EINTR)) continue;  // a read would block now
    const ssize_t count = read(pipe, piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return words;
    words.append(piece.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace

ProgramEnd run_program(const std::vector<std::string>& words, const std::filesystem::path& folder,
                       const std::atomic<bool>* stop) {
  ProgramEnd outcome;
  std::array<int, 2> channel{};
  if (pipe2(channel.data(), O_CLOEXEC) != 0) return {errno, 0, {}};
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, channel[1], STDERR_FILENO);
  pid_t child = 0;
  outcome.start_error = posix_spawnp(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(channel[1]);
  if (outcome.start_error == 0) {
    outcome.words = words_of(child, channel[0], stop);
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
    }
    outcome.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  close(channel[0]);
  return outcome;
}

std::string last_line(std::string text) {
  while (!text.empty() && text.back() == '\n') text.pop_back();
  const std::size_t end_of_previous = text.rfind('\n');
  return end_of_previous == std::string::npos ? text : text.substr(end_of_previous + 1);
}

}  // namespace duet
