#include "sim/scene/reader/prefab_checks.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/base/near_miss.h"
#include "sim/scene/reader/table_reader.h"

namespace duet::scene {
namespace {

const std::vector<std::string> prefab_keys = {"parameters", "rigid", "deformable", "joints"};

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

}  // namespace duet::scene
