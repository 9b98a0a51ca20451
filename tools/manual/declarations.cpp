#include "tools/manual/declarations.h"

#include <algorithm>
#include <sstream>

#include "tools/commands.h"
#include "tools/manual/examples.h"
#include "tools/scene_files.h"
#include <CLI/CLI.hpp>

#include "sim/step/effects.h"

namespace duet::tools::manual {
namespace {

// Returns the words in the braces of "LEVEL:{draft,standard,fine}".
std::vector<std::string> words_in_braces(const std::string& text) {
  const std::size_t open = text.find('{'), close = text.find('}');
  std::vector<std::string> words;
  if (open == std::string::npos || close == std::string::npos || close < open) return words;
  std::istringstream list(text.substr(open + 1, close - open - 1));
  for (std::string word; std::getline(list, word, ',');) words.push_back(word);
  return words;
}

// Returns the values of names that are checked where they are used, not where they are declared.
std::vector<std::string> known_words(const std::string& name) {
  std::vector<std::string> words;
  if (name == "EFFECT") words.assign(effect_names.begin(), effect_names.end());
  if (name == "TEMPLATE")
    for (const ShippedScene& scene : templates())
      if (scene.name != "mesh") words.push_back(scene.name);
  if (name.starts_with("FORMAT")) {
    std::istringstream lines(export_formats());
    for (std::string line; std::getline(lines, line);) {
      std::istringstream fields(line);
      if (std::string word; fields >> word) words.push_back(word);
    }
  }
  return words;
}

// `type` is the name of the value with the description of its bounds, as CLI11 prints it: "N:INT in [1 -
// 1024]".
Value value_of(const std::string& type) {
  Value value;
  value.name = type.substr(0, type == "N|A:B" ? type.size() : type.find(':'));
  value.words = words_in_braces(type);
  if (value.words.empty()) value.words = known_words(value.name);
  const auto is_one_of = [&](std::initializer_list<const char*> names) {
    return std::find(names.begin(), names.end(), value.name) != names.end();
  };
  if (!value.words.empty())
    value.kind = ValueKind::words;
  else if (is_one_of({"SCENE", "SCENE|RUN|STUDY"}))
    value.kind = ValueKind::scene;
  else if (value.name == "RUN")
    value.kind = ValueKind::run;
  else if (value.name == "DIR")
    value.kind = ValueKind::folder;
  else if (value.name == "COMMAND")
    value.kind = ValueKind::command;
  else if (is_one_of({"FILE", "FILE.png", "PAGE.html", "IN", "OUT", "PATH", "SPEC", "A", "B", "NAME"}))
    value.kind = ValueKind::file;
  return value;
}

bool is_repeatable(const CLI::Option& option) {
  return option.get_items_expected_max() > 1 ||
         option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
}

}  // namespace

std::vector<Command> commands_of(const CLI::App& app) {
  std::vector<Command> commands;
  for (const CLI::App* declared : app.get_subcommands([](const CLI::App*) { return true; })) {
    Command command{declared->get_name(), declared->get_description(), {}, {}, {}};
    for (const CLI::Option* option : declared->get_options([](const CLI::Option*) { return true; })) {
      const bool has_value = option->get_items_expected_max() > 0;
      if (option->get_positional()) {
        command.operands.push_back({value_of(option->get_type_name()), option->get_description(),
                                    option->get_required(), option->get_items_expected_max() > 1});
      } else {
        Option& added = command.options.emplace_back();
        added.name = option->get_name();
        added.name = "--" + option->get_lnames().front();
        added.text = option->get_description();
        added.has_value = has_value;
        if (has_value) added.value = value_of(option->get_type_name());
        added.initial = option->get_default_str();
        if (has_value && is_repeatable(*option) && added.text.find("repeatable") == std::string::npos &&
            option->get_items_expected_max() > 2)
          added.text += "; several values";
      }
    }
    command.notes = notes_without_examples(declared->get_footer());
    commands.push_back(std::move(command));
  }
  return commands;
}

std::string synopsis(const Command& command) {
  std::string line = "duet " + command.name;
  for (const Operand& operand : command.operands) {
    const std::string name = operand.value.name + (operand.is_repeatable ? "..." : "");
    line += operand.is_required ? " " + name : " [" + name + "]";
  }
  for (const Option& option : command.options)
    if (option.name == "--to") line += " --to " + option.value.name;
  return line + " [OPTIONS]";
}

}  // namespace duet::tools::manual
