// Implements reference(): the schema as readable text.
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/scene/reader/reader.h"
#include "sim/scene/schema.h"

namespace duet::scene {
namespace {

// Returns the bounds of a key, or the words of a choice, as text.
std::string bounds_text(const Key& key) {
  if (const auto* choice = std::get_if<Choice>(&key.target))
    return fmt::format("\"{}\"", fmt::join(choice->names, "\" \""));
  return key.bounds.text();
}

// Returns the keys of the table that the key holds, or of an element of its list; none for other keys.
std::vector<Key> inner_keys(const Key& key) {
  if (const auto* group = std::get_if<Group>(&key.target)) return group->keys;
  if (const auto* list = std::get_if<List>(&key.target)) return list->element(0);
  return {};
}

constexpr std::size_t page_width = 112;  // characters

// Returns the number of characters of the longest name, with the names of the tables around it:
// "shape.capsule.radius".
std::size_t longest_name(const std::vector<Key>& keys) {
  std::size_t longest = 0;
  for (const Key& key : keys) {
    const std::size_t inner = longest_name(inner_keys(key));
    longest = std::max(longest, key.name.size() + (inner > 0 ? 1 + inner : 0));
  }
  return longest;
}

// Writes a key and the keys inside of it. `prefix` holds the names of the tables around it, `width` is that
// of names.
void write_key(std::string& out, const Key& key, const std::string& prefix, std::size_t width,
               const std::string& default_value) {
  const std::string start = fmt::format("  {:<{}} {:<15} {:<11} {:<22} ", prefix + std::string(key.name),
                                        width, type_text(key), key.unit, default_value);
  const std::string bounds = bounds_text(key);
  // Bounds that do not fit get a line of their own.
  const std::string line = start + (start.size() + bounds.size() > page_width ? "\n      " : "") + bounds;
  out += line.substr(0, line.find_last_not_of(' ') + 1);
  out += fmt::format("\n      {}\n", key.meaning);
  for (const Key& inner : inner_keys(key))
    write_key(out, inner, prefix + std::string(key.name) + ".", width, default_text(inner));
}

// Writes the keys of the solver. Where the defaults of the accuracy presets differ, it gives all three: "0.9
// / 0.7 / 0.175".
void write_solver(std::string& out, std::size_t width) {
  Solver draft = preset(Accuracy::draft), standard = preset(Accuracy::standard),
         fine = preset(Accuracy::fine);
  const auto draft_keys = keys(draft), standard_keys = keys(standard), fine_keys = keys(fine);
  for (std::size_t i = 0; i < standard_keys.size(); ++i) {
    const std::string a = default_text(draft_keys[i]), b = default_text(standard_keys[i]),
                      c = default_text(fine_keys[i]);
    const bool differ = standard_keys[i].name != "accuracy" && (a != b || b != c);
    write_key(out, standard_keys[i], "", width, differ ? fmt::format("{} / {} / {}", a, b, c) : b);
  }
}

}  // namespace

std::string reference() {
  std::string out =
      "Keys of a scene file (TOML). SI units, y up. Where a number is expected, an integer will do; colors "
      "are linear\n"
      "RGB. `--set key=value` sets any of them: solver.cfl=0.5, rigid.NAME.velocity=[0,0,-9], "
      "looks.NAME.color=[1,0,0].\n"
      "Names consist of letters, digits, `_`, `-` and `.`. A table [parameters] holds values that stand for "
      "\"$name\"\n"
      "anywhere in the file: --set parameters.name=value.\n";
  Prototype prototype;
  for (const Section& section : sections(prototype)) {
    out += fmt::format("\n{}: {}\n", section.heading(), section.meaning);
    if (section.name == "solver")
      out += "  defaults under the presets draft / standard / fine where they differ\n";
    const std::size_t width = longest_name(section.keys);
    out +=
        fmt::format("  {:<{}} {:<15} {:<11} {:<22} {}\n", "key", width, "type", "unit", "default", "bounds");
    if (section.name == "solver")
      write_solver(out, width);
    else
      for (const Key& key : section.keys) write_key(out, key, "", width, default_text(key));
  }
  return out;
}

}  // namespace duet::scene
