// Reads TOML tables into the objects that a list of keys is bound to. Internal to the reader: includes
// toml++.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim/scene/reader/document.h"
#include "sim/scene/schema.h"

namespace duet::scene {

/// Reads TOML tables by lists of keys.
class TableReader {
 public:
  /// Flaws are reported to `problems`.
  explicit TableReader(Problems& problems) : problems_(problems) {}

  /// Assigns every key of `table`, the table at `path`, to its target. Reports unknown keys, values of a
  /// wrong type or out of bounds, and missing required keys; the targets of faulty keys keep their defaults.
  /// Keys in `elsewhere` are left to the caller.
  void read(const toml::table& table, const std::vector<Key>& keys, const std::string& path,
            const std::vector<std::string>& elsewhere = {});

  /// Reports a name that cannot become the name of an object or grid. `at` and `path` say where it stands.
  void check_name(const std::string& name, const toml::source_region& at, const std::string& path);

  /// A place where the name of a material, look or rigid body is used.
  struct Use {
    std::string_view section;  ///< Section of the element that is named.
    std::string name;          ///< The name.
    toml::source_region at;    ///< Source position of the name.
    std::string path;          ///< Path of the name in the document.
  };
  /// Returns all uses of names so far, in the order of reading.
  const std::vector<Use>& uses() const { return uses_; }

 private:
  // These functions assign the value `node` at `path` to its target, or report why they cannot. Those that
  // return a bool say whether they did.
  void read_value(const toml::node& node, const Key& key, const std::string& path);
  bool read_number(const toml::node& node, const Key& key, const std::string& path, double& value);
  bool read_integer(const toml::node& node, const Key& key, const std::string& path, int& value);
  template <class Vector, class Read>
  bool read_vector(const toml::node& node, const Key& key, const std::string& path, std::string_view expected,
                   Vector& vector, Read&& read_element);
  bool read_string(const toml::node& node, const Key& key, const std::string& path, std::string_view expected,
                   std::string& value);
  void read_points(const toml::node& node, const Key& key, const std::string& path,
                   std::vector<Vec3>& target);
  void read_references(const toml::node& node, const Key& key, const std::string& path,
                       const References& target);
  void read_list(const toml::node& node, const Key& key, const std::string& path, const List& list);
  void read_choice(const toml::node& node, const Key& key, const std::string& path, const Choice& choice);
  void read_words(const toml::node& node, const Key& key, const std::string& path, const Words& words);
  // These functions report a problem.
  void wrong_type(const toml::node& node, const std::string& path, std::string_view expected,
                  std::string_view meaning);
  void out_of_bounds(const toml::node& node, const Key& key, const std::string& path, std::string_view value);
  void unknown_key(const toml::key& key, const std::vector<std::string>& known, const std::string& path);

  Problems& problems_;
  std::vector<Use> uses_;
};

/// Joins a path and a name: "camera.fov" from "camera" and "fov". At the root, where `path` is empty, it is
/// `name` alone.
std::string join_path(const std::string& path, std::string_view name);

/// One of the tables that the file gives for a List.
struct ListedTable {
  const toml::table* table;  ///< The table.
  std::string path;          ///< Its path in the document.
};
/// Returns the tables that the value `node` at `path` gives for a List: its elements, or itself if it is a
/// single table. Returns none if it has another type.
std::vector<ListedTable> listed_tables(const toml::node& node, const std::string& path);
/// Returns whether `node` is an array without elements.
bool is_empty_array(const toml::node& node);

/// Reports keyframes whose `time` is not later than that of the one before.
void check_times(const std::vector<ListedTable>& keyframes, Problems& problems);

/// Returns the source position to report for a key that may be absent: that of its value, else of its table.
toml::source_region place_of(const toml::table& table, std::string_view key);

/// Returns the index of the only one of the keys `kinds` that the table has. Reports it and returns none if
/// the table, which is at `path`, has no such key or several.
std::optional<std::size_t> only_kind(const toml::table& table, std::span<const std::string_view> kinds,
                                     const std::string& path, Problems& problems);

/// Returns a description of a value for messages: `the text "abc"`, `an array of 2 values`.
std::string describe(const toml::node& node);

}  // namespace duet::scene
