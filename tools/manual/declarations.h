// The commands and options of the program as plain data, read from the declarations that `--help` prints.
// Manual pages and completions are made from them.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace duet::tools::manual {

// What a value on the command line names, which tells a shell what to offer.
enum class ValueKind {
  text,     // numbers, keys, patterns: nothing to offer
  words,    // one of Value::words
  scene,    // a scene that ships, a scene file or the folder of a run
  run,      // the folder of a run, or its name in out/
  file,     // a file
  folder,   // a folder
  command,  // a command of the program
};

// The value of an option or the place of an operand.
struct Value {
  std::string name;  // "N|A:B"
  ValueKind kind = ValueKind::text;
  std::vector<std::string> words;  // for ValueKind::words
};

// An option that begins with dashes.
struct Option {
  std::string name;  // "--frames"
  std::string text;  // what it does
  bool has_value = false;
  Value value;          // if it has one
  std::string initial;  // value unless given; empty: the text tells
};

// A word of the command line that belongs to no option.
struct Operand {
  Value value;
  std::string text;  // what it names
  bool is_required = false, is_repeatable = false;
};

// A command of the program.
struct Command {
  std::string name, text;
  std::vector<Operand> operands;
  std::vector<Option> options;
  std::string notes;  // what --help prints after the options, without the examples; may be empty
};

// Returns the commands of `app` in the order of `--help`.
std::vector<Command> commands_of(const CLI::App& app);

// Returns the command line of a command: "duet run SCENE [OPTIONS]".
std::string synopsis(const Command& command);

}  // namespace duet::tools::manual
