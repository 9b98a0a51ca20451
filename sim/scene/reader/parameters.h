// Puts the values of parameters in place of the texts "$name". Internal to the reader: includes toml++.
#pragma once

#include <set>
#include <string>

#include "sim/scene/reader/document.h"
#include "sim/scene/reader/expansion_limits.h"

namespace duet::scene {

/// Returns the path of the element at `index` of the list at `list`, as the reader names it: `rigid.ball`, or
/// `rigid[2]` if the element has no name.
std::string path_of(const toml::node& element, const std::string& list, std::size_t index);

/// The parameters of a scene, and their use in tables.
class Parameters {
 public:
  /// Texts that name no parameter are reported to `problems`, once for each name. `limits` bounds how many
  /// values are filled in.
  Parameters(Problems& problems, ExpansionLimits& limits) : problems_(problems), limits_(limits) {}

  /// Takes the table [parameters] out of the document and puts its values in, except in prefabs, which are
  /// filled in when they are used. Records where the values are used, for messages.
  void take_from(toml::table& document);
  /// Replaces every text "$name" inside of `node`, an element of a prefab at `path`, by the value of the
  /// parameter: that of `values`, else that of the scene.
  void fill_in(toml::node& node, const toml::table& values, const std::string& path);

 private:
  const toml::node* replacement(const toml::node& text, const toml::table* values, const std::string& path);
  void substitute(toml::node& node, const toml::table* values, const std::string& path);

  Problems& problems_;
  ExpansionLimits& limits_;
  toml::table of_scene_;
  std::set<std::string> reported_;  // unknown parameters that have been reported
};

}  // namespace duet::scene
