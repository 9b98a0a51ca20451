// The scene file as a TOML document: parsing, `--set` overrides, writing. Internal to the reader: includes
// toml++.
#pragma once

#include <string>
#include <vector>

#include <toml++/toml.h>

#include "sim/base/error.h"
#include "sim/scene/places.h"

namespace duet::scene {

// Collects what is wrong with a scene. What an override put into the document has no place in the file: its
// problems are shown under "--set".
class Problems {
 public:
  explicit Problems(std::string file) : file_(std::move(file)) {}
  void add(const toml::source_region& region, std::string key, std::string message, std::string hint = {});
  void add_override(std::string key, std::string message, std::string hint = {});
  void add_global(std::string message, std::string hint = {});  // about the scene as a whole
  // Where the value at the path stands; that of its original if it is a copy.
  toml::source_region place(const toml::source_region& at, const std::string& path) const {
    return at.begin.line > 0 ? at : copies_.find(path);
  }
  CopiedPlaces& copies() { return copies_; }  // what `repeat` and prefabs have made
  std::size_t count() const { return problems_.size(); }
  void throw_if_any();  // SceneError, sorted by line

 private:
  std::string file_;
  CopiedPlaces copies_;
  std::vector<SceneProblem> problems_;
};

// Throws SceneError with the parser's message, line and column.
toml::table parse_document(const std::string& text, const std::string& path);

// Applies "key=value". The value is TOML; a bare word that is none is taken as a string. Elements of lists
// are addressed by name. Keys that the schema does not know are put in as well, for the reader to report.
void apply_override(toml::table& document, const std::string& assignment, Problems& problems);

// The document as TOML text that reads back to the same values.
std::string serialise(const toml::table& document);

}  // namespace duet::scene
