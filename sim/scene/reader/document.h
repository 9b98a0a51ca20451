// Handles the scene file as a TOML document: parsing, `--set` overrides, writing. Internal to the reader:
// includes toml++.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <toml++/toml.h>

#include "sim/base/error.h"
#include "sim/scene/places.h"

namespace duet::scene {

/// Collects the problems of a scene. Values that an override put into the document have no place in the file:
/// their problems are shown under "--set".
class Problems {
 public:
  /// `file` is the path of the scene file as messages show it.
  explicit Problems(std::string file) : file_(std::move(file)) {}
  /// Adds a problem of the value at `region` in the file. `key` is its path in the document; if `region` has
  /// no line, the original of a copied value is looked up by this path. `hint` is a remedy or a near miss.
  void add(const toml::source_region& region, std::string key, std::string message, std::string hint = {});
  /// Records that the value at `path` is that of the parameter `name`, which stands in the file at
  /// `parameter`. The text "$name" that it replaces stands at `use`. Problems of the value are reported there
  /// and name the parameter. A place without a line is that of an override.
  void add_parameter(const std::string& path, const toml::source_region& use, const std::string& name,
                     const toml::source_region& parameter);
  /// Adds a problem of an override.
  void add_override(std::string key, std::string message, std::string hint = {});
  /// Adds a problem of the scene as a whole.
  void add_global(std::string message, std::string hint = {});
  /// Returns the place of the value at `path`: `at` if it has a line, else that of the original that the
  /// value was copied from. Its line is 0 if there is none.
  toml::source_region place(const toml::source_region& at, const std::string& path) const {
    return at.begin.line > 0 ? at : copies_.find(path);
  }
  /// The places of values that `repeat` and prefabs have copied.
  CopiedPlaces& copies() { return copies_; }
  /// Returns the number of problems so far.
  std::size_t count() const { return problems_.size(); }
  /// Throws SceneError with all problems, sorted by line, if there are any.
  void throw_if_any();

 private:
  std::string origin_of(const std::string& path) const;

  std::string file_;
  CopiedPlaces copies_;
  std::map<std::string, std::string> origins_;  // by the paths of values: which parameters they are
  std::vector<SceneProblem> problems_;
};

/// Parses the TOML document `text`; `path` is used in messages. Throws SceneError with the parser's message,
/// line and column.
toml::table parse_document(const std::string& text, const std::string& path);

/// Applies the override `assignment`, "key=value". The value is TOML; a bare word that is no TOML is taken as
/// a string. Elements of lists are addressed by name. Keys that the schema does not know are put in as well,
/// for the reader to report. Other flaws are added to `problems`.
void apply_override(toml::table& document, const std::string& assignment, Problems& problems);

/// Returns the document as TOML text that reads back to the same values.
std::string serialize(const toml::table& document);

}  // namespace duet::scene
