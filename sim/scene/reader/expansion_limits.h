// How much the prefabs, repetitions and parameters of a scene can make: a few lines of a file may ask for
// more than any machine holds. Internal to the reader: includes toml++.
#pragma once

#include "sim/scene/reader/document.h"

namespace duet::scene {

/// Counts what is made, and reports what would be too much before it is made.
class ExpansionLimits {
 public:
  explicit ExpansionLimits(Problems& problems) : problems_(problems) {}

  /// Whether a scene can have so many bodies and joints at all.
  static bool can_hold(double elements);
  /// Whether an instance, `table`, may make `copies` of a prefab of `elements` bodies and joints.
  bool allow_copies(const toml::table& table, double copies, double elements, const std::string& path);
  /// Whether `count` more elements of a list may come from the table `repeat`.
  bool allow_repeat(const toml::table& repeat, int count, const std::string& path);
  /// Whether the value of a parameter may be put in once more, at `at`. Reported once.
  bool allow_value(const toml::node& value, const toml::node& at, const std::string& path);

 private:
  Problems& problems_;
  double copied_ = 0;     // bodies and joints of instances so far
  double repeated_ = 0;   // of repetitions so far
  double filled_in_ = 0;  // values of arrays and tables that parameters have brought so far
  bool is_overfull_ = false;
};

}  // namespace duet::scene
