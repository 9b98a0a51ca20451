#include "sim/scene/reader/table_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/base/near_miss.h"

namespace duet::scene {
namespace {

// A visitor of a variant with one lambda for each case.
template <class... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
template <class... Cases>
Overloaded(Cases...) -> Overloaded<Cases...>;  // clang before 17 cannot deduce it for aggregates

// Returns a number as it would be written in TOML.
std::string number_text(const toml::node& node) {
  if (const auto* integer = node.as_integer()) return std::to_string(integer->get());
  std::string text = fmt::format("{}", node.as_floating_point()->get());
  // A whole floating-point number gets a fraction, such as 30.0, which tells it from an integer. inf and nan
  // stay.
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

// Returns the headings of the sections that have a key of this name: "[ground], [[rigid]]".
std::string homes_of(std::string_view key) {
  std::vector<std::string> homes;
  Prototype prototype;
  for (const Section& section : sections(prototype))
    for (const Key& candidate : section.keys)
      if (candidate.name == key && section.layout != Layout::root) homes.push_back(section.heading());
  return fmt::format("{}", fmt::join(homes, ", "));
}

// The smallest and the largest magnitude of nonzero numbers of a unit. Products of numbers, such as masses
// and moments of inertia, have to stay within the range of floating-point numbers, and the number of time
// steps has to stay finite in practice.
struct Magnitude {
  double least, largest;
};
// Returns the magnitudes that are allowed for a unit.
Magnitude magnitude_of(std::string_view unit) {
  if (unit == "m") return {1e-9, 1e9};                        // a few atoms; about the diameter of the sun
  if (unit == "s") return {1e-12, 1e12};                      // 30,000 years
  if (unit == "Pa") return {1e-30, 1e15};                     // a thousand times the stiffness of diamond
  if (unit == "m/s" || unit == "m/s^2") return {1e-30, 1e9};  // light travels at 3e8 m/s
  if (unit == "1/s" || unit == "rad/s") return {1e-30, 1e9};  // one turn, or radian, in a nanosecond
  return {1e-30, 1e30};
}

bool is_letter_or_digit(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

}  // namespace

std::string join_path(const std::string& path, std::string_view name) {
  return path.empty() ? std::string(name) : fmt::format("{}.{}", path, name);
}

bool is_empty_array(const toml::node& node) {
  const toml::array* array = node.as_array();
  return array && array->empty();
}

void check_times(const std::vector<ListedTable>& keyframes, Problems& problems) {
  for (std::size_t i = 1; i < keyframes.size(); ++i) {
    const auto before = (*keyframes[i - 1].table)["time"].value<double>();
    const auto time = (*keyframes[i].table)["time"].value<double>();
    if (before && time && *time <= *before)
      problems.add(place_of(*keyframes[i].table, "time"), join_path(keyframes[i].path, "time"),
                   fmt::format("must be > {:.6g} s, the time before it, is {:.6g}", *before, *time),
                   "keyframes follow each other in time");
  }
}

toml::source_region place_of(const toml::table& table, std::string_view key) {
  const toml::node* node = table.get(key);
  return node ? node->source() : table.source();
}

std::string describe(const toml::node& node) {
  if (const auto* text = node.as_string()) return fmt::format("the text \"{}\"", text->get());
  if (const auto* boolean = node.as_boolean()) return boolean->get() ? "`true`" : "`false`";
  if (node.is_number()) return fmt::format("the number {}", number_text(node));
  if (const auto* array = node.as_array())
    return fmt::format("an array of {} value{}", array->size(), array->size() == 1 ? "" : "s");
  return node.is_table() ? "a table" : "a date or time";
}

std::optional<std::size_t> only_kind(const toml::table& table, std::span<const std::string_view> kinds,
                                     const std::string& path, Problems& problems) {
  std::vector<std::size_t> given;
  for (std::size_t i = 0; i < kinds.size(); ++i)
    if (table.contains(kinds[i])) given.push_back(i);
  if (given.size() == 1) return given.front();
  const std::string hint = fmt::format("exactly one of {}", fmt::join(kinds, ", "));
  std::vector<std::string_view> names;
  names.reserve(given.size());
  for (const std::size_t i : given) names.push_back(kinds[i]);
  if (given.empty())
    problems.add(table.source(), path, "says no shape", hint);
  else
    problems.add(table.source(), path, fmt::format("is {} at once", fmt::join(names, " and ")), hint);
  return std::nullopt;
}

std::vector<ListedTable> listed_tables(const toml::node& node, const std::string& path) {
  if (const toml::table* table = node.as_table()) return {{table, path}};
  const toml::array* array = node.as_array();
  if (!array || !array->is_homogeneous(toml::node_type::table)) return {};
  std::vector<ListedTable> tables;
  for (std::size_t i = 0; i < array->size(); ++i)
    tables.push_back({(*array)[i].as_table(), fmt::format("{}[{}]", path, i)});
  return tables;
}

void TableReader::read(const toml::table& table, const std::vector<Key>& keys, const std::string& path,
                       const std::vector<std::string>& elsewhere) {
  std::vector<std::string> known = elsewhere;
  for (const Key& key : keys) known.emplace_back(key.name);
  for (const auto& [toml_key, node] : table) {
    const std::string_view name = toml_key.str();
    const auto key = std::find_if(keys.begin(), keys.end(), [&](const Key& k) { return k.name == name; });
    if (key != keys.end())
      read_value(node, *key, join_path(path, name));
    else if (std::find(elsewhere.begin(), elsewhere.end(), name) == elsewhere.end())
      unknown_key(toml_key, known, path);
  }
  for (const Key& key : keys)
    if (key.presence == Presence::required && !table.contains(key.name))
      problems_.add(table.source(), join_path(path, key.name), "missing key", std::string(key.meaning));
}

void TableReader::check_name(const std::string& name, const toml::source_region& at,
                             const std::string& path) {
  const bool legal = std::all_of(name.begin(), name.end(), [](char c) {
    return is_letter_or_digit(c) || c == '_' || c == '-' || c == '.';
  });
  if (name.empty())
    problems_.add(at, path, "the name is empty");
  else if (!legal || name.front() == '-' || name.front() == '.')
    problems_.add(at, path, fmt::format("\"{}\" cannot be a name", name),
                  "names become object and grid names: letters, digits, `_`, `-` and `.`, not starting with "
                  "`-` or `.`");
}

void TableReader::read_value(const toml::node& node, const Key& key, const std::string& path) {
  const auto number = [&](const toml::node& element, const std::string& where, double& value) {
    return read_number(element, key, where, value);
  };
  const auto integer = [&](const toml::node& element, const std::string& where, int& value) {
    return read_integer(element, key, where, value);
  };
  const auto boolean = [&](bool& value) {
    if (const auto* found = node.as_boolean()) {
      value = found->get();
      return true;
    }
    wrong_type(node, path, "true or false", key.meaning);
    return false;
  };
  std::visit(
      Overloaded{
          [&](bool* target) { boolean(*target); },
          [&](std::optional<bool>* target) {
            if (bool value; boolean(value)) *target = value;
          },
          [&](int* target) { integer(node, path, *target); },
          [&](double* target) { number(node, path, *target); },
          [&](std::optional<double>* target) {
            if (double value; number(node, path, value)) *target = value;
          },
          [&](Vec2* target) { read_vector(node, key, path, "an array of 2 numbers", *target, number); },
          [&](Vec3* target) { read_vector(node, key, path, "an array of 3 numbers", *target, number); },
          [&](std::optional<Vec3>* target) {
            Vec3 value;
            if (read_vector(node, key, path, "an array of 3 numbers", value, number)) *target = value;
          },
          [&](Eigen::Vector2i* target) {
            read_vector(node, key, path, "an array of 2 integers", *target, integer);
          },
          [&](Vec3i* target) { read_vector(node, key, path, "an array of 3 integers", *target, integer); },
          [&](std::vector<Vec3>* target) { read_points(node, key, path, *target); },
          [&](std::string* target) { read_string(node, key, path, "a text", *target); },
          [&](const Name& target) {
            if (read_string(node, key, path, "a name", *target.text))
              check_name(*target.text, node.source(), path);
          },
          [&](const Reference& target) {
            if (!read_string(node, key, path, "a name", *target.name)) return;
            if (!target.name->empty())
              uses_.push_back({target.section, *target.name, node.source(), path});
            else if (key.presence == Presence::required)
              problems_.add(node.source(), path, "must not be empty", std::string(key.meaning));
          },
          [&](const References& target) { read_references(node, key, path, target); },
          [&](const Choice& choice) { read_choice(node, key, path, choice); },
          [&](const Words& target) { read_words(node, key, path, target); },
          [&](const Group& group) {
            if (group.given) *group.given = true;
            if (const toml::table* table = node.as_table())
              read(*table, group.keys, path);
            else
              wrong_type(node, path, "a table", key.meaning);
          },
          [&](const List& list) { read_list(node, key, path, list); },
      },
      key.target);
}

void TableReader::read_points(const toml::node& node, const Key& key, const std::string& path,
                              std::vector<Vec3>& target) {
  const toml::array* points = node.as_array();
  if (!points) return wrong_type(node, path, "an array of points [x, y, z]", key.meaning);
  target.clear();
  for (std::size_t i = 0; i < points->size(); ++i) {
    Vec3 value = Vec3::Zero();
    read_vector((*points)[i], key, fmt::format("{}[{}]", path, i), "a point [x, y, z]", value,
                [&](const toml::node& element, const std::string& where, double& number) {
                  return read_number(element, key, where, number);
                });
    target.push_back(value);
  }
}

void TableReader::read_references(const toml::node& node, const Key& key, const std::string& path,
                                  const References& target) {
  const toml::array* names = node.as_array();
  if (!names) return wrong_type(node, path, "an array of names", key.meaning);
  target.names->clear();
  for (std::size_t i = 0; i < names->size(); ++i) {
    const std::string at = fmt::format("{}[{}]", path, i);
    std::string name;
    if (!read_string((*names)[i], key, at, "a name", name)) continue;
    uses_.push_back({target.section, name, (*names)[i].source(), at});
    if (std::find(target.names->begin(), target.names->end(), name) != target.names->end())
      problems_.add((*names)[i].source(), at, fmt::format("`{}` is named twice", name), "name each one once");
    target.names->push_back(name);
  }
}

bool TableReader::read_number(const toml::node& node, const Key& key, const std::string& path,
                              double& value) {
  if (!node.is_number()) {
    wrong_type(node, path, "a number", key.meaning);
    return false;
  }
  const auto* integer = node.as_integer();
  const double candidate = integer ? static_cast<double>(integer->get()) : node.as_floating_point()->get();
  if (!std::isfinite(candidate)) {
    problems_.add(node.source(), path, fmt::format("must be finite, is {}", candidate),
                  std::string(key.meaning));
    return false;
  }
  if (!key.bounds.contains(candidate)) {
    out_of_bounds(node, key, path, number_text(node));
    return false;
  }
  if (const Magnitude can = magnitude_of(key.unit);
      std::abs(candidate) > can.largest ||
      (key.bounds.lower >= 0 && candidate > 0 && candidate < can.least)) {
    problems_.add(node.source(), path,
                  fmt::format("must be between {:g} and {:g} in magnitude, is {}", can.least, can.largest,
                              number_text(node)),
                  std::string(key.meaning));
    return false;
  }
  value = candidate;
  return true;
}

bool TableReader::read_integer(const toml::node& node, const Key& key, const std::string& path, int& value) {
  const auto* integer = node.as_integer();
  if (!integer) {
    wrong_type(node, path, "an integer", key.meaning);
    return false;
  }
  // Every integer key has bounds within those of `int`.
  if (!key.bounds.contains(static_cast<double>(integer->get()))) {
    out_of_bounds(node, key, path, number_text(node));
    return false;
  }
  value = static_cast<int>(integer->get());
  return true;
}

template <class Vector, class Read>
bool TableReader::read_vector(const toml::node& node, const Key& key, const std::string& path,
                              std::string_view expected, Vector& vector, Read&& read_element) {
  const toml::array* array = node.as_array();
  constexpr auto size = Vector::SizeAtCompileTime;
  if (!array || array->size() != static_cast<std::size_t>(size)) {
    wrong_type(node, path, expected, key.meaning);
    return false;
  }
  Vector candidate;
  bool good = true;
  for (int i = 0; i < size; ++i)
    good &= read_element((*array)[static_cast<std::size_t>(i)], fmt::format("{}[{}]", path, i), candidate[i]);
  if (good) vector = candidate;
  return good;
}

bool TableReader::read_string(const toml::node& node, const Key& key, const std::string& path,
                              std::string_view expected, std::string& value) {
  const auto* text = node.as_string();
  if (!text) {
    wrong_type(node, path, expected, key.meaning);
    return false;
  }
  value = text->get();
  return true;
}

void TableReader::read_list(const toml::node& node, const Key& key, const std::string& path,
                            const List& list) {
  const std::vector<ListedTable> tables = listed_tables(node, path);
  if (tables.empty() && !is_empty_array(node))
    wrong_type(node, path, "a table or an array of tables", key.meaning);
  for (std::size_t i = 0; i < tables.size(); ++i) read(*tables[i].table, list.element(i), tables[i].path);
}

void TableReader::read_choice(const toml::node& node, const Key& key, const std::string& path,
                              const Choice& choice) {
  std::string word;
  const std::string expected = fmt::format("one of \"{}\"", fmt::join(choice.names, "\", \""));
  if (!read_string(node, key, path, expected, word)) return;
  const auto found = std::find(choice.names.begin(), choice.names.end(), word);
  if (found != choice.names.end()) {
    choice.select(static_cast<std::size_t>(found - choice.names.begin()));
    return;
  }
  const auto candidate = near_miss(word, {choice.names.begin(), choice.names.end()});
  problems_.add(node.source(), path, fmt::format("must be {}, is \"{}\"", expected, word),
                candidate ? fmt::format("did you mean `{}`?", *candidate) : std::string(key.meaning));
}

void TableReader::read_words(const toml::node& node, const Key& key, const std::string& path,
                             const Words& words) {
  const toml::array* list = node.as_array();
  if (!list) return wrong_type(node, path, "an array of words", key.meaning);
  words.chosen->clear();
  for (std::size_t i = 0; i < list->size(); ++i) {
    const auto take = [&](std::size_t word) { words.chosen->emplace_back(words.names[word]); };
    read_choice((*list)[i], key, fmt::format("{}[{}]", path, i), {words.names, 0, take});
  }
}

void TableReader::wrong_type(const toml::node& node, const std::string& path, std::string_view expected,
                             std::string_view meaning) {
  problems_.add(node.source(), path, fmt::format("must be {}, is {}", expected, describe(node)),
                std::string(meaning));
}

void TableReader::out_of_bounds(const toml::node& node, const Key& key, const std::string& path,
                                std::string_view value) {
  const std::string unit = key.unit.empty() ? "" : fmt::format(" {}", key.unit);
  problems_.add(node.source(), path, fmt::format("must be {}{}, is {}", key.bounds.text(), unit, value),
                std::string(key.meaning));
}

void TableReader::unknown_key(const toml::key& key, const std::vector<std::string>& known,
                              const std::string& path) {
  std::string hint = did_you_mean(key.str(), known);
  if (!near_miss(key.str(), known))
    if (const std::string homes = homes_of(key.str()); !homes.empty())
      hint = fmt::format("`{}` belongs to {}", key.str(), homes);
  problems_.add(key.source(), join_path(path, key.str()), "unknown key", std::move(hint));
}

}  // namespace duet::scene
