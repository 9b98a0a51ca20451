// The program `duet`: reads the command line, carries out its command and prints the outcome.
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>
#include <sstream>

#include "tools/build_info.h"
#include "tools/cache.h"
#include "tools/command_line.h"
#include "tools/interrupt.h"
#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "sim/base/near_miss.h"

namespace duet::tools {
namespace {

constexpr const char* exit_statuses =
    "Exit status: 0 done; 1 pictures or hashes differ; 2 bad usage or scene; 3 the simulation failed; 4 a "
    "file or library; 75 the time of --stop-after is over; 130 interrupted.";

// Returns the command line as it can be typed into a shell again.
std::string quoted(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    if (!text.empty()) text += ' ';
    text += shell_word(word);
  }
  return text;
}

// Returns the command line that continues the run of this one.
std::vector<std::string> resuming(std::vector<std::string> words) {
  std::erase(words, "--overwrite");
  if (std::find(words.begin(), words.end(), "--resume") == words.end()) words.emplace_back("--resume");
  return words;
}

// Opens standard streams that are closed as /dev/null. Otherwise the first file that is written would get the
// number of the stream, and its text.
void open_standard_streams() {
  for (int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(fd, F_GETFD) < 0 && ::open("/dev/null", O_RDWR) < 0)
      ::_exit(static_cast<int>(ExitStatus::files));
}

// Ends the program with a message where an exception cannot be passed on. Destructors of OpenVDB's grids free
// them in parallel, which needs memory, and end the program if there is none.
[[noreturn]] void end_at_lost_exception() {
  try {
    if (const std::exception_ptr lost = std::current_exception()) std::rethrow_exception(lost);
  } catch (const std::bad_alloc&) {
    for (const char* part : {"duet: ", out_of_memory, "\n"})
      if (::write(STDERR_FILENO, part, std::strlen(part)) < 0) break;
    ::_exit(static_cast<int>(ExitStatus::simulation));
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "duet: internal error: %s\n", failure.what());
  } catch (...) {
  }
  std::abort();
}

// Carries out the command. An exception becomes an outcome.
Outcome run_command(const CommandLine& line, Report& report) {
  try {
    if (!line.bypass_cache) use_cache();
    return line.command(report);
  } catch (...) {
    const ExitStatus status = report.failure(std::current_exception());
    switch (status) {
      case ExitStatus::usage:
        return {status, "bad usage or scene, nothing was done"};
      case ExitStatus::simulation:
        return {status, "the simulation did not start"};
      case ExitStatus::interrupted:
        return {status, "the work was given up"};
      default:
        return {status, "a file or library was in the way"};
    }
  }
}

// Returns the message for a bad command line: where to find help, or the most similar command.
std::string usage_message(const CLI::App& app, const CLI::ParseError& error, const std::string& first_word) {
  const auto chosen = app.get_subcommands();
  if (!chosen.empty()) return fmt::format("{} (see `duet {} --help`)", error.what(), chosen[0]->get_name());
  if (first_word.empty() || first_word[0] == '-') return fmt::format("{} (see `duet --help`)", error.what());
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  return fmt::format("{}: no such command ({})", first_word, did_you_mean(first_word, names));
}

// Prints the text that --help or --version asks for, and returns the exit status.
int print_help(const CLI::App& app, const CLI::ParseError& asked, Report& report) {
  try {
    std::ostringstream text;
    app.exit(asked, text, text);
    print(text.str());
    return static_cast<int>(ExitStatus::done);
  } catch (...) {
    return static_cast<int>(report.failure(std::current_exception()));
  }
}

// CLI11 2.5 and newer would fill the lines of notes and examples anew.
template <class Formatter>
void keep_lines(Formatter& formatter) {
  if constexpr (requires { formatter.enable_footer_formatting(false); })
    formatter.enable_footer_formatting(false);
}

int run_program(int argc, char** argv) {
  CommandLine line;
  const std::vector<std::string> words(argv, argv + argc);
  line.simulate.command = quoted(words);
  line.simulate.resume_command = quoted(resuming(words));
  CLI::App app("Duet simulates rigid and deformable bodies that are coupled both ways, and draws them.",
               "duet");
  app.require_subcommand(1);
  app.set_version_flag("--version", version_text());
  app.footer(exit_statuses);
  keep_lines(*app.get_formatter());
  add_commands(app, line);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    Report report({.quiet = line.quiet, .json = line.json});
    if (error.get_exit_code() == 0) return print_help(app, error, report);
    report.error(usage_message(app, error, argc > 1 ? argv[1] : ""));
    report.outcome({ExitStatus::usage, "bad usage, nothing was done"});
    return static_cast<int>(ExitStatus::usage);
  }
  catch_interrupts();
  Report report({.quiet = line.quiet, .json = line.json});
  const Outcome outcome = run_command(line, report);
  if (!outcome.text.empty()) report.outcome(outcome);
  return static_cast<int>(outcome.status);
}

}  // namespace

std::string shell_word(const std::string& word) {
  const bool plain = !word.empty() && word.find_first_not_of(
                                          "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                          "0123456789_-+=:,./@%") == std::string::npos;
  if (plain) return word;
  std::string escaped;
  for (const char c : word) escaped += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return "'" + escaped + "'";
}

}  // namespace duet::tools

int main(int argc, char** argv) {
  std::set_terminate(duet::tools::end_at_lost_exception);
  duet::tools::open_standard_streams();
  std::signal(SIGPIPE, SIG_IGN);  // if a reader goes away (`| head`), only its log ends
  std::signal(SIGXFSZ, SIG_IGN);  // a file at its size limit is reported like a full disk
  try {
    return duet::tools::run_program(argc, argv);
  } catch (const std::exception& failure) {
    // Memory was not enough for the command line or for an error message: this one needs none.
    std::fprintf(stderr,
                 "duet: the program cannot start or end in order: %s (it needs more memory, see ulimit -v)\n",
                 failure.what());
    return static_cast<int>(duet::ExitStatus::files);
  }
}
