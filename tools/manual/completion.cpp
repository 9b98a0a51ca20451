#include "tools/manual/completion.h"

#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/base/error.h"
#include "sim/base/near_miss.h"

namespace duet::tools::manual {
namespace {

// The functions that the completions for bash and zsh share. `duet list --names` reads no scene.
constexpr const char* bash_head = R"(# Completions of duet for bash. `duet manual --shell bash` makes them.
_duet_words() { COMPREPLY=($(compgen -W "$1" -- "$cur")); }
_duet_files() { compopt -o filenames; mapfile -t COMPREPLY < <(compgen -f -- "$cur"); }
_duet_folders() { compopt -o filenames; mapfile -t COMPREPLY < <(compgen -d -- "$cur"); }
_duet_runs() {
  local run names=''
  for run in out/*/manifest.json out/*/*/manifest.json; do
    [[ -e $run ]] && run=${run#out/} && names+=" ${run%/manifest.json}"
  done
  _duet_folders
  COMPREPLY+=($(compgen -W "$names" -- "$cur"))
}
_duet_scenes() {
  local names
  names=$("${COMP_WORDS[0]}" list --names 2>/dev/null)
  compopt -o filenames
  mapfile -t COMPREPLY < <(compgen -f -X '!*.toml' -- "$cur"; compgen -d -- "$cur"; compgen -W "$names" -- "$cur")
}
_duet() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD - 1]} command='' word options='' operand=''
  local commands=')";

// `command` is set to the first word that is no option.
constexpr const char* bash_middle = R"('
  COMPREPLY=()
  for word in "${COMP_WORDS[@]:1:COMP_CWORD-1}"; do
    [[ $word == -* ]] || { command=$word; break; }
  done
  if [[ -z $command ]]; then
    _duet_words "$commands --help --version"
    return
  fi
  case $command in
)";

constexpr const char* bash_tail = R"(  esac
  if [[ $cur == -* ]]; then
    _duet_words "$options --help"
  else
    case $operand in
      scene) _duet_scenes ;;
      run) _duet_runs ;;
      file) _duet_files ;;
      command) _duet_words "$commands" ;;
    esac
  fi
}
complete -F _duet duet
)";

// Returns the name of a kind of operand in the completions for bash.
const char* operand_kind(const Command& command) {
  for (const Operand& operand : command.operands) switch (operand.value.kind) {
      case ValueKind::scene:
        return "scene";
      case ValueKind::run:
        return "run";
      case ValueKind::file:
        return "file";
      case ValueKind::command:
        return "command";
      default:
        break;
    }
  return "";
}

// Returns the line of bash that offers values.
std::string bash_values(const Value& value) {
  switch (value.kind) {
    case ValueKind::words:
      return fmt::format("_duet_words '{}'", fmt::join(value.words, " "));
    case ValueKind::scene:
      return "_duet_scenes";
    case ValueKind::run:
      return "_duet_runs";
    case ValueKind::file:
      return "_duet_files";
    case ValueKind::folder:
      return "_duet_folders";
    case ValueKind::command:
      return "_duet_words \"$commands\"";
    default:
      return ":";
  }
}

std::string names_of(const std::vector<Command>& commands) {
  std::string names;
  for (const Command& command : commands) names += (names.empty() ? "" : " ") + command.name;
  return names;
}

std::string bash(const std::vector<Command>& commands) {
  std::string text = bash_head + names_of(commands) + bash_middle;
  for (const Command& command : commands) {
    text += fmt::format("    {})\n      operand='{}'\n      options='", command.name, operand_kind(command));
    for (const Option& option : command.options)
      if (option.name != "--help") text += option.name + " ";
    if (text.back() == ' ') text.pop_back();
    text += "'\n      case $prev in\n";
    for (const Option& option : command.options)
      if (option.has_value)
        text += fmt::format("        {}) {}; return ;;\n", option.name, bash_values(option.value));
    text += "      esac\n      ;;\n";
  }
  return text + bash_tail;
}

// Returns the text as it stands between single quotes; characters of `special` get a backslash.
std::string inside_quotes(const std::string& text, const std::string& special) {
  std::string result;
  for (const char c : text) {
    if (c == '\'')
      result += "'\\''";
    else if (special.find(c) != std::string::npos)
      result += std::string("\\") + c;
    else
      result += c == '\n' ? ' ' : c;
  }
  return result;
}

// Returns the text in single quotes.
std::string quoted(const std::string& text, const std::string& special) {
  return fmt::format("'{}'", inside_quotes(text, special));
}

// Returns what `_arguments` of zsh does to offer values.
std::string zsh_values(const Value& value) {
  switch (value.kind) {
    case ValueKind::words:
      return fmt::format("({})", fmt::join(value.words, " "));
    case ValueKind::scene:
      return "_duet_scenes";
    case ValueKind::run:
      return "_duet_runs";
    case ValueKind::file:
      return "_files";
    case ValueKind::folder:
      return "_files -/";
    case ValueKind::command:
      return "_duet_commands";
    default:
      return " ";
  }
}

std::string zsh(const std::vector<Command>& commands) {
  constexpr const char* special = "[]:\\";
  std::string text =
      "#compdef duet\n# Completions of duet for zsh. `duet manual --shell zsh` makes them.\n"
      "_duet_scenes() {\n  local -a names\n  names=(${(f)\"$(duet list --names 2>/dev/null)\"})\n"
      "  compadd -a names\n  _files -g '*.toml'\n  _files -/\n}\n"
      "_duet_runs() {\n  local -a names\n  names=(out/*/manifest.json(N) out/*/*/manifest.json(N))\n"
      "  names=(${${names#out/}%/manifest.json})\n  compadd -a names\n  _files -/\n}\n"
      "_duet_commands() {\n  local -a commands\n  commands=(\n";
  for (const Command& command : commands)
    text += fmt::format("    {}\n", quoted(command.name + ":" + command.text, ""));
  text +=
      "  )\n  _describe command commands\n}\n_duet() {\n  local state line\n  local -a options\n"
      "  _arguments -C '--version[print the version]' '--help[print help]' '1: :_duet_commands' '*:: "
      ":->rest'\n"
      "  [[ $state == rest ]] || return\n  case $words[1] in\n";
  for (const Command& command : commands) {
    text += fmt::format("    {})\n      options=(\n", command.name);
    for (const Option& option : command.options) {
      // The asterisk allows the option several times.
      text += fmt::format("        '*{}[{}]", option.name, inside_quotes(option.text, special));
      if (option.has_value)
        text += fmt::format(":{}:{}", inside_quotes(option.value.name, special), zsh_values(option.value));
      text += "'\n";
    }
    for (const Operand& operand : command.operands)
      text += fmt::format("        '{}:{}:{}'\n", operand.is_repeatable ? "*" : "", operand.value.name,
                          zsh_values(operand.value));
    text += "      )\n      _arguments $options\n      ;;\n";
  }
  return text + "  esac\n}\n_duet \"$@\"\n";
}

// Returns the options of `complete` of fish that offer values.
std::string fish_values(const Value& value) {
  switch (value.kind) {
    case ValueKind::words:
      return fmt::format(" -x -a '{}'", fmt::join(value.words, " "));
    case ValueKind::scene:
      return " -r -k -a '(duet list --names 2>/dev/null)'";
    case ValueKind::run:
      return " -r -a '(__fish_complete_directories) (__duet_runs)'";
    case ValueKind::folder:
      return " -x -a '(__fish_complete_directories)'";
    case ValueKind::command:
      return " -x -a '$duet_commands'";
    case ValueKind::file:
      return " -r -F";
    default:
      return " -x";
  }
}

std::string fish(const std::vector<Command>& commands) {
  constexpr const char* special = "\\";
  std::string text = fmt::format(
      "# Completions of duet for fish. `duet manual --shell fish` makes them.\n"
      "function __duet_runs\n    for file in out/*/manifest.json out/*/*/manifest.json\n"
      "        string replace -r '^out/(.*)/manifest.json$' '$1' $file\n    end\nend\n"
      "set -g duet_commands {}\ncomplete -c duet -f\n"
      "complete -c duet -n \"not __fish_seen_subcommand_from $duet_commands\" -l version -d 'Print the "
      "version'\n",
      names_of(commands));
  for (const Command& command : commands)
    text +=
        fmt::format("complete -c duet -n \"not __fish_seen_subcommand_from $duet_commands\" -a {} -d {}\n",
                    command.name, quoted(command.text, special));
  for (const Command& command : commands) {
    const std::string start =
        fmt::format("complete -c duet -n '__fish_seen_subcommand_from {}'", command.name);
    for (const Option& option : command.options)
      text += fmt::format("{} -l {}{} -d {}\n", start, option.name.substr(2),
                          option.has_value ? fish_values(option.value) : "", quoted(option.text, special));
    for (const Operand& operand : command.operands)
      if (operand.value.kind != ValueKind::text) text += start + fish_values(operand.value) + "\n";
  }
  return text;
}

}  // namespace

std::string completion(const std::string& shell, const std::vector<Command>& commands) {
  if (shell == "bash") return bash(commands);
  if (shell == "zsh") return zsh(commands);
  if (shell == "fish") return fish(commands);
  throw Error(ExitStatus::usage,
              fmt::format("--shell {}: unknown ({})", shell, did_you_mean(shell, {"bash", "zsh", "fish"})));
}

}  // namespace duet::tools::manual
