// Where in the scene file values stand that `repeat` and prefabs have copied from there: copies in toml++ do
// not know. Internal to the reader: includes toml++.
#pragma once

#include <map>
#include <memory>
#include <string>

#include <toml++/toml.h>

namespace duet::scene {

// Of all values in a table, by their paths below it: "" for itself, ".mass", ".pins[1].body".
using Places = std::map<std::string, toml::source_region>;

class CopiedPlaces {
 public:
  // Those of a table that is to be copied; `path` is its own, as it may be a copy itself.
  std::shared_ptr<const Places> of(const toml::table& original, const std::string& path) const;
  // From here on the table at `path` is a copy of the one that `places` are of.
  void add(const std::string& path, std::shared_ptr<const Places> places);
  // The place of the value that was copied to `path`, or of the innermost table around it that the original
  // has; line 0 if it is no part of a copy.
  toml::source_region find(const std::string& path) const;
  bool empty() const { return copies_.empty(); }

 private:
  void record(const toml::node& node, const std::string& path, const std::string& below,
              Places& places) const;
  std::map<std::string, std::shared_ptr<const Places>> copies_;
};

}  // namespace duet::scene
