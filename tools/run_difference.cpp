#include "tools/run_difference.h"

#include <algorithm>
#include <map>
#include <sstream>
#include <vector>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "sim/io/run_journal.h"
#include "sim/io/run_source.h"
#include "sim/scene/plan.h"

namespace duet::tools {
namespace {

constexpr std::size_t most_named = 3;     // differences that a message names
constexpr std::size_t most_letters = 40;  // of a value that is quoted

using Values = std::map<std::string, std::string>;  // by their keys, as --set names them

std::string text_of_value(const toml::node& node) {
  std::ostringstream stream;
  stream << toml::node_view<const toml::node>(node);
  std::string text = stream.str();
  if (text.size() > most_letters) text = text.substr(0, most_letters) + "...";
  return text;
}

// Adds the values of a document below `key`. Elements of arrays of tables have their names as keys, or their
// numbers from 1.
void add_values(const toml::node& node, const std::string& key, Values& values) {
  const auto below = [&](std::string_view name) {
    return key.empty() ? std::string(name) : fmt::format("{}.{}", key, name);
  };
  if (const toml::table* table = node.as_table()) {
    for (const auto& [name, value] : *table) add_values(value, below(name.str()), values);
    return;
  }
  const toml::array* array = node.as_array();
  if (array == nullptr || array->empty() || !array->is_homogeneous<toml::table>()) {
    values[key] = text_of_value(node);
    return;
  }
  for (std::size_t i = 0; i < array->size(); ++i) {
    const auto name = (*array)[i].as_table()->get_as<std::string>("name");
    add_values((*array)[i], below(name != nullptr ? name->get() : std::to_string(i + 1)), values);
  }
}

// Appends how the values of two documents differ.
void add_differences(const std::string& before, const std::string& now, std::vector<std::string>& found) {
  Values old_values, new_values;
  add_values(toml::parse(before), "", old_values);
  add_values(toml::parse(now), "", new_values);
  for (const auto& [key, value] : new_values) {
    const auto old = old_values.find(key);
    if (old == old_values.end())
      found.push_back(fmt::format("`{}` is {} and was not given", key, value));
    else if (old->second != value)
      found.push_back(fmt::format("`{}` is {} and was {}", key, value, old->second));
  }
  for (const auto& [key, value] : old_values)
    if (!new_values.contains(key)) found.push_back(fmt::format("`{}` is not given and was {}", key, value));
}

// Appends the mesh files that have another content than the copies in the run's source, whose folders are
// named by their content.
void add_meshes(const io::RunSource& source, const scene::ReadResult& read, std::vector<std::string>& found) {
  for (const auto& [name, path] : read.files) {
    const auto copy = source.files.find(name);
    if (copy == source.files.end()) continue;  // the scene names it, which is a difference of its own
    const std::string content = fmt::format("{:016x}", io::mark_of_file(path).hash);
    if (io::fs::path(copy->second).parent_path().filename() != content)
      found.push_back(fmt::format("the mesh {} has changed", name));
  }
}

std::string list_of(std::vector<std::string> names) {
  std::sort(names.begin(), names.end());
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "nothing" : text;
}

std::string joined(const std::vector<std::string>& found) {
  std::string text;
  for (std::size_t i = 0; i < std::min(most_named, found.size()); ++i)
    text += (i == 0 ? "" : "; ") + found[i];
  if (found.size() > most_named) text += fmt::format("; and {} more differences", found.size() - most_named);
  return text;
}

}  // namespace

std::string difference_from_run(const io::RunDirectory& run, const SceneChoice& choice,
                                const scene::ReadResult& read) try {
  const io::RunDirectory checked = io::open_run(run.root);
  const std::optional<io::RunSource> source = io::read_source(checked);
  if (!source) return {};
  const std::string before = checked.read(checked.scene());
  std::vector<std::string> found;
  add_differences(before, read.source, found);
  add_meshes(*source, read, found);
  const auto effects = [&](const std::vector<std::string>& without) {
    return scene::plan_effects(read.scene, without).active().to_string();
  };
  if (effects(source->without) != effects(choice.without))
    found.push_back(fmt::format("--without leaves out {} and left out {}", list_of(choice.without),
                                list_of(source->without)));
  if (found.empty() && before != read.source)
    found.emplace_back("only comments or the layout of the scene file differ");
  return joined(found);
} catch (const Error&) {
  return {};  // the copy is damaged, or of another program: nothing can be said
} catch (const toml::parse_error&) {
  return {};
}

}  // namespace duet::tools
