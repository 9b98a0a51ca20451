// Pieces of USD's text format (.usda). Numbers have the fewest digits that read back to the same bits.
#pragma once

#include <array>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sim/base/types.h"

namespace duet::io {

/// Returns a string of the format with its quotes. Quotes, backslashes and control characters are escaped.
std::string usd_string(std::string_view text);

/// Gives out names of prims, each once: identifiers of ASCII letters, digits and underscores.
class UsdNames {
 public:
  /// Returns an identifier that resembles the name and has not been given out before.
  std::string take(std::string_view name);

 private:
  std::set<std::string, std::less<>> taken_;
};

/// Returns the text "displayName = ..." if the identifier differs from the name, and an empty text
/// otherwise.
std::string usd_display_name(std::string_view name, std::string_view identifier);

/// Returns the tuple (x, y, z).
std::string usd_tuple(const Vec3& v);
/// Returns the tuple (w, x, y, z).
std::string usd_tuple(const Quat& q);
/// Returns an array of tuples (x, y, z).
std::string usd_array(const std::vector<Vec3f>& vectors);
/// Returns an array of tuples (x, y).
std::string usd_array(const std::vector<Vec2f>& vectors);
/// Returns an array of integers.
std::string usd_array(const std::vector<int>& numbers);
/// Returns an array of tuples whose coordinates, in [-1, 1], are rounded to four digits after the point. It
/// serves normals: the error of 5e-5 is invisible, and the text is shorter.
std::string usd_rounded_array(const std::vector<Vec3f>& vectors);

/// Returns an array of numbers that are rounded to five significant digits.
std::string usd_rounded_array(const std::vector<float>& numbers);

/// Values of an attribute at frames, as text. Of successive frames with one value only the first and the
/// last have a sample, because readers interpolate between samples. A value that never changes is written
/// without samples.
class UsdSamples {
 public:
  /// Adds the value at a frame. Frames have to come in ascending order.
  void add(int frame, std::string value);
  /// Returns true if no value has been added.
  bool empty() const { return frames_.empty(); }
  /// Returns the length of the values of all samples, bytes.
  std::size_t bytes() const { return bytes_; }
  /// Returns "TYPE NAME = VALUE" or "TYPE NAME.timeSamples = {...}" with indentation and line end.
  /// `declaration` is "TYPE NAME". At least one value must have been added.
  std::string text(std::string_view indent, std::string_view declaration) const;

 private:
  std::vector<int> frames_;          // frames of the samples
  std::vector<std::string> values_;  // values of the samples
  std::size_t bytes_ = 0;
};

}  // namespace duet::io
