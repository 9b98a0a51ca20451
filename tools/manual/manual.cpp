// `duet manual`: prints manual pages and completions, or writes them where a system looks for them.
#include <algorithm>
#include <filesystem>

#include "tools/manual/completion.h"
#include "tools/manual/declarations.h"
#include "tools/manual/examples.h"
#include "tools/manual/man_page.h"
#include "tools/option_parts.h"
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/base/near_miss.h"

namespace duet::tools {
namespace {
namespace fs = std::filesystem;

// Files of completions below the prefix of an installation, where Debian's shells look for them.
constexpr std::pair<const char*, const char*> completions[] = {
    {"bash", "share/bash-completion/completions/duet"},
    {"zsh", "share/zsh/site-functions/_duet"},
    {"fish", "share/fish/vendor_completions.d/duet.fish"}};

void write(const fs::path& path, const std::string& text) {
  io::create_folder(path.parent_path());
  io::write_atomically(path, text);
}

// Writes all pages and completions below the prefix. Returns how many files these are.
std::size_t write_all(const fs::path& prefix, const std::vector<manual::Command>& commands) {
  write(prefix / "share/man/man1/duet.1", manual::main_page(commands));
  for (const manual::Command& command : commands)
    write(prefix / fmt::format("share/man/man1/duet-{}.1", command.name), manual::command_page(command));
  for (const auto& [shell, path] : completions) write(prefix / path, manual::completion(shell, commands));
  return 1 + commands.size() + std::size(completions);
}

// Parses every example as the program would, without running it. Throws Error (usage) with the example that
// is none. Returns their lines.
std::string checked_examples(const std::vector<manual::Command>& commands) {
  std::string text;
  for (const manual::Command& command : commands)
    for (const Example& example : examples_of(command.name)) {
      CommandLine line;
      CLI::App app("", "duet");
      app.require_subcommand(1);
      add_commands(app, line);
      std::vector<std::string> words = words_of(example);
      std::reverse(words.begin(), words.end());  // CLI11 takes the first word from the end
      try {
        app.parse(words);
      } catch (const CLI::ParseError& error) {
        throw Error(ExitStatus::usage, fmt::format("{}: {}", example.line, error.what()));
      }
      text += example.line + '\n';
    }
  return text;
}

const manual::Command& find(const std::vector<manual::Command>& commands, const std::string& name) {
  std::vector<std::string> names;
  for (const manual::Command& command : commands) {
    if (command.name == name) return command;
    names.push_back(command.name);
  }
  throw Error(ExitStatus::usage, fmt::format("{}: no such command ({})", name, did_you_mean(name, names)));
}

Outcome print_manual(const CLI::App& app, const ManualOptions& options) {
  const std::vector<manual::Command> commands = manual::commands_of(app);
  if (!options.into.empty()) {
    const std::size_t count = write_all(options.into, commands);
    return {ExitStatus::done,
            fmt::format("{} files of manual pages and completions below {}", count, options.into)};
  }
  if (options.examples)
    print(checked_examples(commands));
  else if (!options.shell.empty())
    print(manual::completion(options.shell, commands));
  else
    print(options.command.empty() ? manual::main_page(commands)
                                  : manual::command_page(find(commands, options.command)));
  return {};
}

}  // namespace

void add_manual(CLI::App& app, CommandLine& line) {
  ManualOptions& options = line.manual;
  CLI::App& added = *app.add_subcommand("manual", "Manual pages, and completions for shells");
  CLI::Option* command =
      added.add_option("command", options.command, "The command to describe; default: the program")
          ->type_name("COMMAND");
  CLI::Option* shell = added.add_option("--shell", options.shell, "Print the completions for this shell")
                           ->check(CLI::IsMember({"bash", "zsh", "fish"}))
                           ->excludes(command)
                           ->type_name("SHELL");
  CLI::Option* examples = added
                              .add_flag("--examples", options.examples,
                                        "Print the examples of all commands, after each was parsed")
                              ->excludes(command)
                              ->excludes(shell);
  added
      .add_option(
          "--into", options.into,
          "Write all pages and completions below this prefix, as `cmake --install` does: share/man/man1, ...")
      ->excludes(command)
      ->excludes(shell)
      ->excludes(examples)
      ->type_name("DIR");
  added.callback(
      [&app, &line] { line.command = [&app, &line](Report&) { return print_manual(app, line.manual); }; });
}

}  // namespace duet::tools
