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

class TableReader {
 public:
  explicit TableReader(Problems& problems) : problems_(problems) {}

  // Assigns every key of `table` to its target. Reports unknown keys, values of a wrong type or out of
  // bounds, and missing required keys; the targets of faulty keys keep their defaults. Keys in `elsewhere`
  // are left to the caller.
  void read(const toml::table& table, const std::vector<Key>& keys, const std::string& path,
            const std::vector<std::string>& elsewhere = {});

  // Reports a name that cannot become an object or grid name.
  void check_name(const std::string& name, const toml::source_region& at, const std::string& path);

  // Where names of materials and looks were used, in the order of reading.
  struct Use {
    std::string_view section;
    std::string name;
    toml::source_region at;
    std::string path;
  };
  const std::vector<Use>& uses() const { return uses_; }

 private:
  void read_value(const toml::node& node, const Key& key, const std::string& path);
  bool read_number(const toml::node& node, const Key& key, const std::string& path, double& value);
  bool read_integer(const toml::node& node, const Key& key, const std::string& path, int& value);
  template <class Vector, class Read>
  bool read_vector(const toml::node& node, const Key& key, const std::string& path, std::string_view expected,
                   Vector& vector, Read&& read_element);
  bool read_string(const toml::node& node, const Key& key, const std::string& path, std::string_view expected,
                   std::string& value);
  void read_list(const toml::node& node, const Key& key, const std::string& path, const List& list);
  void read_choice(const toml::node& node, const Key& key, const std::string& path, const Choice& choice);
  void wrong_type(const toml::node& node, const std::string& path, std::string_view expected,
                  std::string_view meaning);
  void out_of_bounds(const toml::node& node, const Key& key, const std::string& path, std::string_view value);
  void unknown_key(const toml::key& key, const std::vector<std::string>& known, const std::string& path);

  Problems& problems_;
  std::vector<Use> uses_;
};

// "camera.fov" of "camera" and "fov"; `name` alone at the root.
std::string join_path(const std::string& path, std::string_view name);

// The tables of a List's value in the file; none if it is of another type.
struct ListedTable {
  const toml::table* table;
  std::string path;
};
std::vector<ListedTable> listed_tables(const toml::node& node, const std::string& path);
bool is_empty_array(const toml::node& node);  // a List of nothing

// Reports keyframes whose `time` is not later than that of the one before.
void check_times(const std::vector<ListedTable>& keyframes, Problems& problems);

// Where to point for a key that may be absent: at its value, else at its table.
toml::source_region place_of(const toml::table& table, std::string_view key);

// Which of `kinds` the table has, for tables that must have exactly one; reports it where that is not so.
std::optional<std::size_t> only_kind(const toml::table& table, std::span<const std::string_view> kinds,
                                     const std::string& path, Problems& problems);

// What a value is, for messages: `the text "abc"`, `an array of 2 values`.
std::string describe(const toml::node& node);

}  // namespace duet::scene
