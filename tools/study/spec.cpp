#include "tools/study/spec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/base/files.h"
#include "sim/scene/reader/table_reader.h"

namespace duet::study {
namespace {

using scene::Bounds;
using scene::Key;
using scene::Problems;

constexpr std::array<std::string_view, 15> measure_names = {
    "slide",    "free_top",         "pendulum",    "cantilever", "vibrating_bar",
    "state",    "centres",          "penetration", "energy",     "energy_gain",
    "momentum", "angular_momentum", "joints",      "volume",     "image"};

// A key whose value is one of `names`, in the order of the enumerators.
template <class Enum>
scene::Choice choice(Enum& target, std::vector<std::string_view> names) {
  return {std::move(names), static_cast<std::size_t>(target),
          [&target](std::size_t i) { target = static_cast<Enum>(i); }};
}

const Bounds any{}, non_negative{.lower = 0}, positive{.lower = 0, .lower_open = true};
Bounds between(double lower, double upper) { return {.lower = lower, .upper = upper}; }
constexpr auto required = scene::Presence::required;

// Keys at the top of the document.
std::vector<Key> keys(Spec& spec) {
  return {
      {"title", &spec.title, "", any, "of the report", required},
      {"about", &spec.about, "", any, "what the study asks, for the report"},
      {"scene", &spec.scene, "", any, "path of a scene file, or name of a scene that ships", required},
      {"frames", &spec.frames, "", between(1, 1e5), "the last one of every run: a short horizon", required},
      {"repetitions", &spec.repetitions, "", between(1, 1000),
       "timed runs of each setting, whose median counts"},
      {"time_limit", &spec.time_limit, "s", positive, "of a run; what takes longer has failed"},
      {"cost", choice(spec.cost, {"simulation", "drawing"}), "", any,
       "whether the seconds are those of simulating, or of drawing the last frame"},
      {"count", choice(spec.count, {"steps", "iterations"}), "", any,
       "cost that no machine changes: substeps, or substeps and CG iterations times unknowns"},
      {"effects", &spec.effects, "", any, "also run without each effect that the scene calls for"},
      {"picture_width", &spec.picture_width, "pixels", between(16, 4096), "of pictures in the report"},
      {"picture_height", &spec.picture_height, "pixels", between(16, 4096), "of pictures in the report"},
  };
}

// Keys of [[measures]].
std::vector<Key> keys(Measure& measure) {
  return {
      {"name", &measure.name, "", any, "of the measure, in charts and tables", required},
      {"kind", choice(measure.kind, {measure_names.begin(), measure_names.end()}), "", any,
       "what is measured, and against what", required},
      {"body", &measure.body, "", any, "whose motion is measured"},
      {"slope", &measure.slope, "degrees", between(0, 90), "of a slide towards -x"},
      {"friction", &measure.friction, "", non_negative, "of a slide"},
      {"floor", &measure.floor, "", non_negative, "errors up to this are rounding, and left out of orders"},
  };
}

// Returns a value as TOML, with numbers as short as they are exact.
std::string toml_text(const toml::node& node) {
  if (const auto* number = node.as_floating_point()) return fmt::format("{}", number->get());
  if (const toml::array* array = node.as_array()) {
    std::vector<std::string> elements;
    for (const toml::node& element : *array) elements.push_back(toml_text(element));
    return fmt::format("[{}]", fmt::join(elements, ", "));
  }
  std::ostringstream out;
  out << toml::node_view<const toml::node>(node);
  return out.str();
}

// Returns a value as it would be typed after `--set KEY=`.
std::string value_text(const toml::node& node) {
  const auto* text = node.as_string();
  return text ? text->get() : toml_text(node);
}

// Returns the number that stands for a value in orders: the value, or the largest number of an array.
std::optional<double> number_in(const toml::node& node) {
  if (node.is_number()) return node.value<double>();
  const toml::array* array = node.as_array();
  if (!array) return std::nullopt;
  std::optional<double> largest;
  for (const toml::node& element : *array)
    if (const auto number = element.is_number() ? element.value<double>() : std::nullopt)
      largest = std::max(largest.value_or(*number), *number);
  return largest;
}

// Reads the document and collects all problems.
class SpecReader {
 public:
  SpecReader(const toml::table& document, Problems& problems)
      : document_(document), problems_(problems), reader_(problems) {}

  Spec read() {
    Spec spec;
    reader_.read(document_, keys(spec), "", {"set", "without", "reference", "measures", "knobs"});
    spec.base = read_change(document_, "");
    if (const toml::node* node = document_.get("reference")) {
      if (const toml::table* table = node->as_table()) {
        reader_.read(*table, {}, "reference", {"set", "without"});
        spec.reference = read_change(*table, "reference");
        spec.reference->label = "reference";
      } else {
        wrong_type(*node, "reference", "a table [reference]");
      }
    }
    for_each("measures", [&](const toml::table& table, const std::string& path) {
      spec.measures.push_back(read_measure(table, path, spec.reference.has_value()));
    });
    for_each("knobs", [&](const toml::table& table, const std::string& path) {
      spec.knobs.push_back(read_knob(table, path));
    });
    if (spec.measures.empty()) problems_.add_global("the study has no measure", "add a [[measures]]");
    if (spec.knobs.empty() && !spec.effects)
      problems_.add_global("the study turns no knob", "add a [[knobs]], or effects = true");
    return spec;
  }

 private:
  void wrong_type(const toml::node& node, const std::string& path, const std::string& expected) {
    problems_.add(node.source(), path, fmt::format("must be {}, is {}", expected, scene::describe(node)));
  }

  // Calls `read` for each table of a list.
  template <class Read>
  void for_each(std::string_view section, Read&& read) {
    const toml::node* node = document_.get(section);
    if (!node) return;
    const toml::array* list = node->as_array();
    if (!list || list->empty() || !list->is_homogeneous(toml::node_type::table))
      return wrong_type(*node, std::string(section), fmt::format("a list of tables [[{}]]", section));
    for (const scene::ListedTable& element : scene::listed_tables(*node, std::string(section)))
      read(*element.table, element.path);
  }

  // Reads an array of texts; empty if the key is missing.
  std::vector<std::string> read_texts(const toml::table& table, std::string_view key,
                                      const std::string& path) {
    std::vector<std::string> texts;
    const toml::node* node = table.get(key);
    if (!node) return texts;
    const std::string at = scene::join_path(path, key);
    const toml::array* array = node->as_array();
    if (!array) {
      wrong_type(*node, at, "an array of texts");
      return texts;
    }
    for (const toml::node& element : *array) {
      if (const auto* text = element.as_string())
        texts.push_back(text->get());
      else
        wrong_type(element, at, "a text");
    }
    return texts;
  }

  // Reads `set` and `without` of a table.
  Change read_change(const toml::table& table, const std::string& path) {
    return {{}, read_texts(table, "set", path), read_texts(table, "without", path), {}};
  }

  Measure read_measure(const toml::table& table, const std::string& path, bool has_reference) {
    Measure measure;
    reader_.read(table, keys(measure), path);
    if (needs_reference(measure.kind) && !has_reference)
      problems_.add(scene::place_of(table, "kind"), path,
                    "is measured against a reference, and there is none",
                    "add a table [reference] with `set`");
    const bool of_one_body = measure.kind <= MeasureKind::vibrating_bar;
    if (of_one_body && measure.body.empty())
      problems_.add(table.source(), scene::join_path(path, "body"), "missing key",
                    "whose motion is measured");
    if (measure.kind != MeasureKind::slide)
      for (const std::string_view key : {"slope", "friction"})
        if (table.contains(key))
          problems_.add(scene::place_of(table, key), scene::join_path(path, key), "belongs to slides only");
    return measure;
  }

  Knob read_knob(const toml::table& table, const std::string& path) {
    Knob knob;
    std::string key;
    reader_.read(table,
                 {{"name", &knob.name, "", any, "of the line in charts", required},
                  {"key", &key, "", any, "of the scene, which gets one of `values` after the other"},
                  {"order", choice(knob.order, {"none", "steps", "cells"}), "", any,
                   "fit the errors' order of convergence, in the time step or the size of cells"},
                  {"pictures", &knob.pictures, "", any, "show the last frame of each value"}},
                 path, {"values", "settings", "set", "without"});
    const Change shared = read_change(table, path);
    const toml::node* values = table.get("values");
    const toml::node* settings = table.get("settings");
    if ((values != nullptr) == (settings != nullptr) || (values != nullptr) != !key.empty()) {
      problems_.add(table.source(), path, "turns nothing",
                    "give `key` and `values`, or `settings = [{ label = \"...\", set = [\"key=value\"] }]`");
      return knob;
    }
    const toml::node& list = values ? *values : *settings;
    const toml::array* array = list.as_array();
    if (!array || array->empty()) {
      wrong_type(list, scene::join_path(path, values ? "values" : "settings"),
                 "an array of one or more values");
      return knob;
    }
    for (std::size_t i = 0; i < array->size(); ++i) {
      const std::string at = fmt::format("{}.{}[{}]", path, values ? "values" : "settings", i);
      Change change = values ? value_change(key, (*array)[i]) : setting_change((*array)[i], at);
      change.set.insert(change.set.begin(), shared.set.begin(), shared.set.end());
      change.without.insert(change.without.begin(), shared.without.begin(), shared.without.end());
      knob.values.push_back(std::move(change));
    }
    return knob;
  }

  // Returns the change to one of a knob's `values`.
  static Change value_change(const std::string& key, const toml::node& node) {
    const std::string value = value_text(node);
    return {value, {fmt::format("{}={}", key, value)}, {}, number_in(node)};
  }

  // Returns the change of one of a knob's `settings`.
  Change setting_change(const toml::node& node, const std::string& path) {
    const toml::table* table = node.as_table();
    if (!table) {
      wrong_type(node, path, "a table");
      return {};
    }
    Change change = read_change(*table, path);
    reader_.read(*table,
                 {{"label", &change.label, "", any, "of the point in charts", required},
                  {"number", &change.number, "", positive, "of cells, for their order of convergence"}},
                 path, {"set", "without"});
    return change;
  }

  const toml::table& document_;
  Problems& problems_;
  scene::TableReader reader_;
};

}  // namespace

bool needs_reference(MeasureKind kind) {
  return kind == MeasureKind::state || kind == MeasureKind::centers || kind == MeasureKind::image;
}

std::string unit_of(MeasureKind kind) {
  switch (kind) {
    case MeasureKind::state:
    case MeasureKind::centers:
    case MeasureKind::penetration:
    case MeasureKind::joints:
      return "m";
    case MeasureKind::free_top:
    case MeasureKind::pendulum:
      return "rad";
    default:
      return "";
  }
}

Spec read_spec(const std::string& path) {
  const std::string text = io::read_file(path);
  Problems problems(path);
  const toml::table document = scene::parse_document(text, path);
  Spec spec = SpecReader(document, problems).read();
  problems.throw_if_any();
  spec.path = path;
  // A path of a scene is relative to the folder of the spec, wherever the program is called.
  const io::fs::path beside = io::fs::path(path).parent_path() / spec.scene;
  std::error_code missing;
  if (io::fs::is_regular_file(beside, missing)) spec.scene = beside.string();
  return spec;
}

tools::SceneChoice scene_of(const Spec& spec, const Change& change) {
  tools::SceneChoice choice;
  choice.name = spec.scene;
  choice.set = spec.base.set;
  choice.set.insert(choice.set.end(), change.set.begin(), change.set.end());
  choice.without = spec.base.without;
  choice.without.insert(choice.without.end(), change.without.begin(), change.without.end());
  return choice;
}

}  // namespace duet::study
