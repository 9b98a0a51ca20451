#include "sim/scene/reader/document.h"

#include <algorithm>
#include <memory>
#include <sstream>

#include <fmt/format.h>

#include "sim/base/near_miss.h"
#include "sim/scene/reader/prefab_checks.h"
#include "sim/scene/schema.h"

namespace duet::scene {
namespace {

constexpr const char* override_file = "--set";  // shown in place of a file for problems of overrides

// Largest number of parts of a key such as a.b.c. The parser recurses for each part of a key, and so does all
// code that visits the tables that it makes: many more parts than this overflow the stack.
constexpr std::ptrdiff_t max_parts = 100;

// Returns the first line (1-based) with a key of more than `max_parts` parts; 0 if there is none. Dots in
// strings and comments count as well, up to the end of the line or the next character that no key has.
std::size_t line_of_deep_key(const std::string& text) {
  std::size_t line = 1;
  std::ptrdiff_t dots = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\n') ++line;
    if (c == '\n' || c == '=' || c == ',' || c == '#' || c == '[' || c == '{') dots = 0;
    if (c == '.' && (i == 0 || text[i - 1] != '.') && ++dots > max_parts) return line;
  }
  return 0;
}

// Returns whether a node with this source position was made by an override: such nodes have none, or one in
// the document that the override was parsed from.
bool is_of_override(const toml::source_region& region) {
  return region.begin.line == 0 || (region.path && *region.path == override_file);
}

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

// Parses the value of an override as TOML and returns it in a table under the key "value". A bare word
// becomes a string. Text that begins like a TOML string, array or table and is none is reported.
std::optional<toml::table> parse_value(const std::string& key, const std::string& text, Problems& problems) {
  if (text.empty()) {
    problems.add_override(key, "has no value", "write `\"\"` for an empty text");
    return std::nullopt;
  }
  try {
    toml::table parsed = toml::parse("value = " + text, std::string_view(override_file));
    if (parsed.size() == 1) return parsed;
  } catch (const toml::parse_error& error) {
    if (std::string_view("[{\"'").find(text.front()) != std::string_view::npos) {
      problems.add_override(key, fmt::format("`{}` is no TOML value: {}", text, error.description()));
      return std::nullopt;
    }
  }
  return toml::table{{"value", text}};
}

// Returns the table under `key`, which is made if absent. If the value is no table, reports it for
// `whole_key` and returns null.
toml::table* enter(toml::table& table, std::string_view key, const std::string& whole_key,
                   Problems& problems) {
  if (!table.contains(key)) table.insert(key, toml::table{});
  toml::table* inner = table[key].as_table();
  if (!inner)
    problems.add_override(whole_key, fmt::format("`{}` is no table, it has no keys of its own", key));
  return inner;
}

// Returns the element of the list whose name `path` begins with, and the rest of the path after the name;
// null if there is none. Names may hold dots, so that the longest name that fits is taken.
std::pair<toml::table*, std::string> find_element(toml::array& list, const std::string& path) {
  toml::table* found = nullptr;
  std::string longest;
  for (toml::node& node : list) {
    toml::table* element = node.as_table();
    const auto name = element ? (*element)["name"].value<std::string>() : std::nullopt;
    if (!name || name->empty() || !path.starts_with(*name + ".") || (found && name->size() < longest.size()))
      continue;
    found = element;
    longest = *name;
  }
  return {found, found ? path.substr(longest.size() + 1) : std::string()};
}

// Returns the names of the elements of a list.
std::vector<std::string> element_names(const toml::array& list) {
  std::vector<std::string> names;
  for (const toml::node& node : list)
    if (const toml::table* element = node.as_table())
      if (const auto name = (*element)["name"].value<std::string>()) names.push_back(*name);
  return names;
}

// Reports an override whose `path` names no key of an element of the list `section`. `list` may be null.
void report_missing_element(const toml::array* list, const std::string& section, const std::string& path,
                            const std::string& key, Problems& problems) {
  const std::vector<std::string> names = list ? element_names(*list) : std::vector<std::string>{};
  const std::string name = path.substr(0, path.find('.'));
  if (std::find(names.begin(), names.end(), path) != names.end())
    problems.add_override(key, "names an element, not one of its keys",
                          fmt::format("{}.velocity=[0,0,1]", key));
  else
    problems.add_override(key, fmt::format("no [[{}]] is named `{}`", section, name),
                          did_you_mean(name, names));
}

// Returns the table that holds the last part of `key`, and that part. Tables on the path are made if absent.
// If the path leads through something else, reports it and returns null.
std::pair<toml::table*, std::string> resolve(toml::table& document, const std::string& key,
                                             Problems& problems) {
  toml::table* table = &document;
  std::string path = key;
  const auto step = [&](std::size_t length) {
    table = enter(*table, path.substr(0, length), key, problems);
    path = path.substr(length + 1);
  };

  Prototype prototype;
  const auto known = sections(prototype);
  const auto dot = key.find('.');
  const std::string head = key.substr(0, dot);
  const auto section =
      std::find_if(known.begin(), known.end(), [&](const Section& s) { return s.name == head; });
  if (dot != std::string::npos && section != known.end()) {
    if (section->layout == Layout::list) {
      toml::array* list = document[head].as_array();
      path = key.substr(dot + 1);
      std::string rest;
      if (list) std::tie(table, rest) = find_element(*list, path);
      if (!list || !table) {
        report_missing_element(list, head, path, key, problems);
        return {nullptr, {}};
      }
      path = rest;
    } else if (section->layout == Layout::named && key.rfind('.') != dot) {
      step(dot);
      if (table) step(path.rfind('.'));  // the name itself may hold dots
    }
  }
  while (table && path.find('.') != std::string::npos) step(path.find('.'));
  return {table, path};
}

}  // namespace

void Problems::add(const toml::source_region& region, std::string key, std::string message,
                   std::string hint) {
  const toml::source_region at = place(region, key);
  if (region.begin.line == 0) message += origin_of(key);
  if (is_of_override(at)) {
    add_override(std::move(key), std::move(message), std::move(hint));
    return;
  }
  problems_.push_back({file_, static_cast<int>(at.begin.line), static_cast<int>(at.begin.column),
                       std::move(key), std::move(message), std::move(hint)});
}

void Problems::add_parameter(const std::string& path, const toml::source_region& use, const std::string& name,
                             const toml::source_region& parameter) {
  if (!is_of_override(use)) copies_.add(path, std::make_shared<Places>(Places{{"", use}}));
  const std::string place =
      is_of_override(parameter) ? "set by --set" : fmt::format("in line {}", parameter.begin.line);
  origins_.insert_or_assign(path, fmt::format(", from the parameter `{}` {}", name, place));
}

// Returns a phrase that says which parameter the value at `path`, or the array or table around it, is; empty
// if it is none.
std::string Problems::origin_of(const std::string& path) const {
  for (std::string outer = path;; outer.resize(outer.find_last_of(".["))) {
    if (const auto found = origins_.find(outer); found != origins_.end()) return found->second;
    if (outer.find_last_of(".[") == std::string::npos) return {};
  }
}

void Problems::add_override(std::string key, std::string message, std::string hint) {
  problems_.push_back({override_file, 0, 0, std::move(key), std::move(message), std::move(hint)});
}

void Problems::add_global(std::string message, std::string hint) {
  problems_.push_back({file_, 0, 0, {}, std::move(message), std::move(hint)});
}

// Merges problems that are repeated in copies of a table into the first of them. Requires problems sorted by
// place.
std::vector<SceneProblem> merge_repeated_problems(const std::vector<SceneProblem>& sorted) {
  std::vector<SceneProblem> result;
  std::size_t more = 0;
  const auto close = [&] {
    if (more > 0)
      result.back().message += fmt::format(" (as in {} other {})", more, more == 1 ? "copy" : "copies");
    more = 0;
  };
  std::string message;  // original message of the last problem in `result`
  for (const SceneProblem& problem : sorted) {
    const bool again = !result.empty() && problem.line > 0 && problem.line == result.back().line &&
                       problem.column == result.back().column && problem.message == message;
    if (again) {
      ++more;
      continue;
    }
    close();
    result.push_back(problem);
    message = problem.message;
  }
  close();
  return result;
}

void Problems::throw_if_any() {
  if (problems_.empty()) return;
  std::stable_sort(problems_.begin(), problems_.end(), [](const SceneProblem& a, const SceneProblem& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  });
  throw SceneError(merge_repeated_problems(problems_));
}

toml::table parse_document(const std::string& text, const std::string& path) {
  if (const std::size_t line = line_of_deep_key(text); line > 0)
    throw SceneError({{path,
                       static_cast<int>(line),
                       1,
                       {},
                       fmt::format("TOML syntax: a key has more than {} parts with dots between", max_parts),
                       "keys of scenes have at most six"}});
  try {
    return toml::parse(text, path);
  } catch (const toml::parse_error& error) {
    const toml::source_position at = error.source().begin;
    throw SceneError({{path,
                       static_cast<int>(at.line),
                       static_cast<int>(at.column),
                       {},
                       fmt::format("TOML syntax: {}", error.description()),
                       {}}});
  }
}

void apply_override(toml::table& document, const std::string& assignment, Problems& problems) {
  const auto equals = assignment.find('=');
  const std::string key = trimmed(assignment.substr(0, equals));
  if (equals == std::string::npos || key.empty()) {
    problems.add_override(assignment, "is no assignment", "write key=value, for example solver.cfl=0.5");
    return;
  }
  if (key.front() == '.' || key.back() == '.' || key.find("..") != std::string::npos) {
    problems.add_override(key, "has an empty part between its dots");
    return;
  }
  if (std::count(key.begin(), key.end(), '.') > max_parts) {
    problems.add_override(key.substr(0, 40) + "...",
                          fmt::format("has more than {} parts with dots between", max_parts),
                          "keys of scenes have at most six");
    return;
  }
  std::optional<toml::table> value = parse_value(key, trimmed(assignment.substr(equals + 1)), problems);
  if (!value || !check_declared(document, key, *value->get("value"), problems)) return;
  const auto [table, name] = resolve(document, key, problems);
  if (!table) return;
  value->get("value")->visit(
      [&, &target = *table, &last = name](auto& node) { target.insert_or_assign(last, node); });
}

std::string serialize(const toml::table& document) {
  std::ostringstream out;
  // Literal strings are turned off: toml++ 3.3 writes control characters into them as escapes, which literal
  // strings do not support.
  out << toml::toml_formatter{document, toml::toml_formatter::default_flags &
                                            ~toml::format_flags::allow_literal_strings}
      << '\n';
  return out.str();
}

}  // namespace duet::scene
