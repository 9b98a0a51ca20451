#include "sim/scene/reader/parameters.h"

#include <cctype>
#include <utility>

#include <fmt/format.h>

namespace duet::scene {
namespace {

// Returns whether the text has the form "$name".
bool names_parameter(const std::string& text) {
  return text.size() > 1 && text[0] == '$' && (std::isalpha(static_cast<unsigned char>(text[1])) != 0);
}

}  // namespace

std::string path_of(const toml::node& element, const std::string& list, std::size_t index) {
  const toml::table* table = element.as_table();
  const std::string name = table ? (*table)["name"].value_or(std::string()) : std::string();
  return name.empty() ? fmt::format("{}[{}]", list, index) : fmt::format("{}.{}", list, name);
}

void Parameters::take_from(toml::table& document) {
  toml::table* parameters = document["parameters"].as_table();
  if (!parameters) return;
  of_scene_ = std::move(*parameters);  // values that are moved keep their lines, unlike copies
  document.erase("parameters");
  for (auto&& [key, value] : document) {
    const std::string name(key.str());
    if (name == "prefabs") continue;
    if (const toml::node* with = replacement(value, nullptr, name)) {
      with->visit([&, &at = key](const auto& v) { document.insert_or_assign(at, v); });
      continue;
    }
    toml::array* list = value.as_array();
    if (list && list->is_homogeneous(toml::node_type::table))
      for (std::size_t i = 0; i < list->size(); ++i)
        substitute((*list)[i], nullptr, path_of((*list)[i], name, i));
    else
      substitute(value, nullptr, name);
  }
}

void Parameters::fill_in(toml::node& node, const toml::table& values, const std::string& path) {
  substitute(node, &values, path);
}

// Returns the value that belongs in place of the node at `path`; null if the node names no parameter that
// there is. `values` are the parameters of the prefab; null outside of prefabs, where the place is recorded.
const toml::node* Parameters::replacement(const toml::node& text, const toml::table* values,
                                          const std::string& path) {
  const auto* word = text.as_string();
  if (!word || !names_parameter(word->get())) return nullptr;
  const std::string name = word->get().substr(1);
  const toml::node* found = values ? values->get(name) : nullptr;
  if (!found) found = of_scene_.get(name);
  if (!found) {
    if (reported_.insert(name).second)
      problems_.add(text.source(), path, fmt::format("there is no parameter `{}`", name),
                    "add it to the `parameters` of the prefab or of the scene");
    return nullptr;
  }
  if (!values) problems_.add_parameter(path, text.source(), name, found->source());
  return limits_.allow_value(*found, text, path) ? found : nullptr;
}

void Parameters::substitute(toml::node& node, const toml::table* values, const std::string& path) {
  if (toml::table* table = node.as_table()) {
    for (auto&& [key, value] : *table) {
      const std::string inner = fmt::format("{}.{}", path, key.str());
      if (const toml::node* with = replacement(value, values, inner))
        with->visit([&, &at = key](const auto& v) { table->insert_or_assign(at, v); });
      else
        substitute(value, values, inner);
    }
  } else if (toml::array* array = node.as_array()) {
    for (std::size_t i = 0; i < array->size(); ++i) {
      const std::string inner = fmt::format("{}[{}]", path, i);
      if (const toml::node* with = replacement((*array)[i], values, inner))
        with->visit(
            [&](const auto& v) { array->replace(array->cbegin() + static_cast<std::ptrdiff_t>(i), v); });
      else
        substitute((*array)[i], values, inner);
    }
  }
}

}  // namespace duet::scene
