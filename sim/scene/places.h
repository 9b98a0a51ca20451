// Remembers where in the scene file the values stand that `repeat` and prefabs copy, because copies of toml++
// nodes have no source position. Internal to the reader: includes toml++.
#pragma once

#include <map>
#include <memory>
#include <string>

#include <toml++/toml.h>

namespace duet::scene {

/// Source positions of all values in a table, by their paths relative to it, such as ".mass" or
/// ".pins[1].body". The path of the table itself is empty.
using Places = std::map<std::string, toml::source_region>;

/// The source positions of copied tables.
class CopiedPlaces {
 public:
  /// Returns the source positions of all values in `original`, a table that is to be copied. `path` is its
  /// path in the document; it is needed if the table is a copy itself.
  std::shared_ptr<const Places> of(const toml::table& original, const std::string& path) const;
  /// Records that the table at `path` is a copy of the table that `places` belong to.
  void add(const std::string& path, std::shared_ptr<const Places> places);
  /// Returns the source position of the value that was copied to `path`. If the original has no such value,
  /// it is that of the innermost table around it; if `path` is in no copy, its line is 0.
  toml::source_region find(const std::string& path) const;
  /// True if no copy has been recorded.
  bool empty() const { return copies_.empty(); }

 private:
  void record(const toml::node& node, const std::string& path, const std::string& below,
              Places& places) const;
  std::map<std::string, std::shared_ptr<const Places>> copies_;  // by the paths of the copies
};

}  // namespace duet::scene
