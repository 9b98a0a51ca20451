#include "sim/scene/reader/expansion_limits.h"

#include <algorithm>

#include <fmt/format.h>

namespace duet::scene {
namespace {

// Largest number of bodies and joints of a scene. Each of them takes about a kilobyte in the document.
constexpr double max_elements = 2e5;
// Largest number of values inside of arrays and tables that parameters fill in. Each of them takes about a
// hundred bytes.
constexpr double max_filled_in = 1e6;

// Returns the number of values in an array or table, with those of inner ones; 0 for a number or text.
double values_in(const toml::node& node) {
  double count = 0;
  if (const toml::table* table = node.as_table())
    for (auto&& [key, value] : *table) count += 1 + values_in(value);
  else if (const toml::array* array = node.as_array())
    for (const toml::node& value : *array) count += 1 + values_in(value);
  return count;
}

}  // namespace

bool ExpansionLimits::can_hold(double elements) { return elements <= max_elements; }

bool ExpansionLimits::allow_copies(const toml::table& table, double copies, double elements,
                                   const std::string& path) {
  const double more = copies * std::max(elements, 1.0);
  if (copied_ + more <= max_elements) {
    copied_ += more;
    return true;
  }
  problems_.add(table.source(), path,
                fmt::format("makes {:g} copies of {:g} bodies and joints, which with those before it is more "
                            "than {:g}, the most that a scene can have",
                            copies, elements, max_elements),
                "lower its grid, its scatter.count or the `repeat` of what the prefab holds");
  return false;
}

bool ExpansionLimits::allow_repeat(const toml::table& repeat, int count, const std::string& path) {
  if (repeated_ + count <= max_elements) {
    repeated_ += count;
    return true;
  }
  problems_.add(
      repeat.source(), path + ".repeat.count",
      fmt::format("makes {} bodies or joints, which with those before it is more than {:g}, the most "
                  "that a scene can have",
                  count, max_elements),
      "lower the count");
  return false;
}

bool ExpansionLimits::allow_value(const toml::node& value, const toml::node& at, const std::string& path) {
  if (is_overfull_) return false;
  filled_in_ += values_in(value);
  is_overfull_ = filled_in_ > max_filled_in;
  if (is_overfull_)
    problems_.add(at.source(), path,
                  fmt::format("the parameters fill in more than {:g} values of arrays and tables, the most "
                              "that a scene can have",
                              max_filled_in),
                  "use long arrays in fewer places");
  return !is_overfull_;
}

}  // namespace duet::scene
