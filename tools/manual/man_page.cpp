#include "tools/manual/man_page.h"

#include <algorithm>
#include <cctype>

#include "tools/manual/examples.h"
#include "tools/version.h"
#include <fmt/format.h>

namespace duet::tools::manual {
namespace {

// Returns text in which roff sees no requests and no escapes. Hyphens become minus signs, as they are typed.
std::string roff(const std::string& text) {
  std::string escaped;
  bool begins_line = true;
  for (const char c : text) {
    if (begins_line && (c == '.' || c == '\'')) escaped += "\\&";
    if (c == '\\')
      escaped += "\\e";
    else if (c == '-')
      escaped += "\\-";
    else
      escaped += c;
    begins_line = c == '\n';
  }
  return escaped;
}

// Returns text whose words in backquotes are bold.
std::string marked(const std::string& text) {
  std::string result;
  bool is_bold = false;
  for (const char c : roff(text)) {
    if (c != '`') {
      result += c;
      continue;
    }
    is_bold = !is_bold;
    result += is_bold ? "\\fB" : "\\fR";
  }
  return is_bold ? result + "\\fR" : result;
}

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

std::string head(const std::string& name, const std::string& text) {
  return fmt::format(".TH {} 1 \"\" \"duet {}\" \"Duet\"\n.SH NAME\n{} \\- {}\n", roff(upper(name)), version,
                     roff(name), marked(text));
}

// Returns the lines of a text as they are.
std::string as_it_stands(const std::string& text) { return fmt::format(".nf\n{}\n.fi\n", marked(text)); }

std::string option_text(const Option& option) {
  std::string text = fmt::format(".TP\n\\fB{}\\fR", roff(option.name));
  if (option.has_value) text += fmt::format(" \\fI{}\\fR", roff(option.value.name));
  text += '\n' + marked(option.text);
  if (option.value.kind == ValueKind::words) {
    text += option.text.ends_with('.') ? "\nOne of" : ".\nOne of";
    for (std::size_t i = 0; i < option.value.words.size(); ++i)
      text += fmt::format("{} \\fB{}\\fR", i == 0 ? "" : ",", roff(option.value.words[i]));
    text += '.';
  }
  if (!option.initial.empty()) text += fmt::format("\nThe default is {}.", roff(option.initial));
  return text + '\n';
}

}  // namespace

std::string main_page(const std::vector<Command>& commands) {
  std::string text =
      head("duet", "simulate rigid and deformable bodies that are coupled both ways, and draw them");
  text += ".SH SYNOPSIS\n\\fBduet\\fR \\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n.br\n\\fBduet\\fR \\-\\-version\n";
  text +=
      ".SH DESCRIPTION\n" +
      marked(
          "A scene is a TOML file of bodies, materials, joints, a camera and lights. `duet new` writes one, "
          "`duet run` simulates and draws it into a folder, the run, which the other commands read.") +
      '\n';
  text += ".SH COMMANDS\n";
  for (const Command& command : commands)
    text += fmt::format(".TP\n\\fBduet\\-{}\\fR(1)\n{}\n", roff(command.name), marked(command.text));
  text += ".SH EXIT STATUS\n";
  for (const auto& [status, meaning] :
       {std::pair{"0", "Done."}, std::pair{"1", "Pictures or hashes differ."},
        std::pair{"2", "Bad usage or scene; nothing was done."}, std::pair{"3", "The simulation failed."},
        std::pair{"4", "A file or library."}, std::pair{"75", "The time of \\-\\-stop\\-after is over."},
        std::pair{"130", "Interrupted."}})
    text += fmt::format(".TP\n{}\n{}\n", status, meaning);
  text += ".SH ENVIRONMENT\n.TP\n\\fBDUET_CACHE\\fR\nFolder of cached tetrahedra, or \\fBoff\\fR.\n";
  text +=
      ".TP\n\\fBDUET_ISA\\fR\nInstruction set of a portable program: \\fBx86\\-64\\fR, \\fBx86\\-64\\-v3\\fR "
      "or "
      "\\fBx86\\-64\\-v4\\fR.\n";
  return text;
}

std::string command_page(const Command& command) {
  std::string text = head("duet-" + command.name, command.text);
  text += fmt::format(".SH SYNOPSIS\n\\fB{}\\fR\n", roff(synopsis(command)));
  text += ".SH DESCRIPTION\n" + marked(command.text) + ".\n";
  for (const Operand& operand : command.operands)
    text += fmt::format(".TP\n\\fI{}\\fR\n{}\n", roff(operand.value.name), marked(operand.text));
  text += ".SH OPTIONS\n";
  for (const Option& option : command.options) text += option_text(option);
  if (!command.notes.empty()) text += ".SH NOTES\n" + as_it_stands(command.notes);
  text += ".SH EXAMPLES\n";
  for (const Example& example : examples_of(command.name))
    text += fmt::format(".TP\n\\fB{}\\fR\n{}\n", roff(example.line), marked(example.text));
  return text + ".SH SEE ALSO\n\\fBduet\\fR(1)\n";
}

}  // namespace duet::tools::manual
