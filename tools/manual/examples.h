// Examples of every command, which `--help` and the manual pages print.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace duet::tools {

// A command line that works as it stands, and what it does.
struct Example {
  std::string line;  // "duet run stack --frames 48"
  std::string text;  // "the first two seconds: ..."
};

// Returns the examples of a command; empty for a word that is no command.
std::vector<Example> examples_of(const std::string& command);

// Adds the examples of a command to what its `--help` prints last.
void add_examples(CLI::App& command);

// Returns the text that `--help` prints last without the examples that add_examples() appended.
std::string notes_without_examples(const std::string& footer);

// Returns the words of an example's line as a shell splits them, without the word `duet`. Double quotes keep
// words together.
std::vector<std::string> words_of(const Example& example);

}  // namespace duet::tools
