#include "sim/scene/reader/prefab_checks.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/base/near_miss.h"
#include "sim/scene/reader/table_reader.h"

namespace duet::scene {
namespace {

const std::vector<std::string> prefab_keys = {"parameters", "rigid", "deformable", "joints"};

std::vector<std::string> keys_of(const toml::table& table) {
  std::vector<std::string> keys;
  for (auto&& [key, value] : table) keys.emplace_back(key.str());
  return keys;
}

// Returns the node as a table. If it is something else, reports that `heading` was expected and returns null.
const toml::table* table_at(const toml::node& node, const std::string& path, const std::string& heading,
                            Problems& problems) {
  if (!node.is_table())
    problems.add(node.source(), path, fmt::format("must be a table [{}], is {}", heading, describe(node)),
                 fmt::format("write [{}] with one bracket above its keys", heading));
  return node.as_table();
}

// Reports a node that is not a list of tables with at least one element.
void check_list(const toml::node& node, const std::string& path, Problems& problems) {
  const toml::array* list = node.as_array();
  if (list && !list->empty() && list->is_homogeneous(toml::node_type::table)) return;
  problems.add(node.source(), path,
               fmt::format("must be a list of tables [[{}]], is {}", path, describe(node)),
               fmt::format("write [[{}]] with two brackets above the keys of each element", path));
}

void check_prefab(const toml::table& prefab, const std::string& path, Problems& problems) {
  bool is_empty = true;
  for (auto&& [key, value] : prefab) {
    const std::string name(key.str()), inner = join_path(path, name);
    if (name == "parameters") {
      table_at(value, inner, inner, problems);
      continue;
    }
    is_empty = false;
    if (name == "instances")
      problems.add(key.source(), inner, "a prefab cannot hold instances of prefabs",
                   "list the bodies themselves, or place both prefabs by [[instances]] of the scene");
    else if (std::find(prefab_keys.begin(), prefab_keys.end(), name) == prefab_keys.end())
      problems.add(key.source(), inner, "unknown key", did_you_mean(name, prefab_keys));
    else
      check_list(value, inner, problems);
  }
  if (is_empty)
    problems.add(prefab.source(), path, "the prefab holds no bodies",
                 fmt::format("add tables [[{}.rigid]] or [[{}.deformable]]", path, path));
}

// Reports an override of an entry of `table`, which is null if the document has none, if it has no entry
// `name`. `what` says what the entries are.
bool check_entry(const toml::table* table, const std::string& name, const std::string& key,
                 const std::string& what, Problems& problems) {
  if (table && table->contains(name)) return true;
  problems.add_override(key, fmt::format("{} `{}`", what, name),
                        table ? did_you_mean(name, keys_of(*table)) : std::string("it declares none"));
  return false;
}

// Checks an override of parameters. `path` is the rest of its key behind the table of the parameters; if it
// is empty, the override replaces the whole table by `value`.
bool check_parameters(const toml::table* declared, const std::string& path, const std::string& key,
                      const std::string& what, const toml::node& value, Problems& problems) {
  if (!path.empty()) return check_entry(declared, path.substr(0, path.find('.')), key, what, problems);
  bool good = true;
  if (const toml::table* values = value.as_table())
    for (const std::string& name : keys_of(*values))
      good = check_entry(declared, name, key, what, problems) && good;
  return good;
}

}  // namespace

void check_expanded_tables(const toml::table& document, Problems& problems) {
  if (const toml::node* parameters = document.get("parameters"))
    table_at(*parameters, "parameters", "parameters", problems);
  if (const toml::node* instances = document.get("instances")) check_list(*instances, "instances", problems);
  const toml::node* node = document.get("prefabs");
  const toml::table* prefabs = node ? table_at(*node, "prefabs", "prefabs.NAME", problems) : nullptr;
  if (!prefabs) return;
  for (auto&& [name, value] : *prefabs) {
    const std::string path = join_path("prefabs", name);
    if (const toml::table* prefab = table_at(value, path, path, problems))
      check_prefab(*prefab, path, problems);
  }
}

void check_instance(const toml::table& table, const Instance& instance, const std::string& path,
                    Problems& problems) {
  for (const std::string_view key : {"set", "vary"})
    if (const toml::node* node = table.get(key); node && !node->is_table())
      problems.add(node->source(), join_path(path, key),
                   fmt::format("must be a table of parameters, is {}", describe(*node)),
                   fmt::format("for example {} = {{ size = {} }}", key, key == "set" ? "0.5" : "[0.4, 0.6]"));
  if (!instance.has_scatter) return;
  for (const std::string_view key : {"grid", "step"})
    if (const toml::node* node = table.get(key))
      problems.add(node->source(), join_path(path, key), "has no effect together with `scatter`",
                   fmt::format("copies stand on a grid or at random places; remove `{}` or `scatter`", key));
}

void check_advance(const toml::table& repeat, const std::string& path, Problems& problems) {
  if (const toml::node* advance = repeat.get("advance"); advance && !advance->is_table())
    problems.add(advance->source(), join_path(path, "repeat.advance"),
                 fmt::format("must be a table of numbers, is {}", describe(*advance)),
                 "for example advance = { mass = 2 }");
}

bool check_declared(const toml::table& document, const std::string& key, const toml::node& value,
                    Problems& problems) {
  const auto dot = key.find('.');
  const std::string head = key.substr(0, dot), rest = dot == std::string::npos ? "" : key.substr(dot + 1);
  if (head == "parameters")
    return check_parameters(document["parameters"].as_table(), rest, key, "the scene has no parameter", value,
                            problems);
  if (head != "prefabs" || rest.empty()) return true;
  const toml::table* prefabs = document["prefabs"].as_table();
  const auto second = rest.find('.');
  const std::string name = rest.substr(0, second);
  if (!check_entry(prefabs, name, key, "the scene has no prefab", problems)) return false;
  const std::string inner = second == std::string::npos ? "" : rest.substr(second + 1);
  if (inner != "parameters" && !inner.starts_with("parameters.")) return true;
  return check_parameters((*prefabs)[name]["parameters"].as_table(),
                          inner.size() > 11 ? inner.substr(11) : std::string(), key,
                          fmt::format("the prefab `{}` has no parameter", name), value, problems);
}

}  // namespace duet::scene
