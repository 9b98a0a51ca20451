// Limits how much the prefabs, repetitions and parameters of a scene can make: a few lines of a file may ask
// for more than any machine holds. Internal to the reader: includes toml++.
#pragma once

#include "sim/scene/reader/document.h"

namespace duet::scene {

/// Counts the bodies, joints and values that an expansion makes, and reports excess before it is made.
class ExpansionLimits {
 public:
  /// Too large requests are reported to `problems`.
  explicit ExpansionLimits(Problems& problems) : problems_(problems) {}

  /// Returns whether a scene can have this many bodies and joints at all.
  static bool can_hold(double elements);
  /// Returns whether an instance may make `copies` copies of a prefab with `elements` bodies and joints, and
  /// counts them if so; otherwise reports it. `table` is the table of the instance and `path` its path.
  bool allow_copies(const toml::table& table, double copies, double elements, const std::string& path);
  /// Returns whether the table `repeat` may make `count` more elements of the list at `path`, and counts them
  /// if so; otherwise reports it.
  bool allow_repeat(const toml::table& repeat, int count, const std::string& path);
  /// Returns whether the value of a parameter may be put in once more, in place of the node `at`, and counts
  /// the values inside of it. Excess is reported once; from then on the answer is false.
  bool allow_value(const toml::node& value, const toml::node& at, const std::string& path);

 private:
  Problems& problems_;
  double copied_ = 0;     // bodies and joints that instances have made so far
  double repeated_ = 0;   // bodies and joints that repetitions have made so far
  double filled_in_ = 0;  // values of arrays and tables that parameters have brought so far
  bool is_overfull_ = false;
};

}  // namespace duet::scene
