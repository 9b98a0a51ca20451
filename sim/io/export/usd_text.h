/// Pieces of USD's text format (.usda).
#pragma once

#include <array>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "sim/base/types.h"

namespace duet::io {

/// A string of the format with its quotes.
std::string usd_string(std::string_view text);

/// Gives out names of prims: identifiers of ASCII letters, digits and _, each once.
class UsdNames {
 public:
  /// An identifier that resembles the name.
  std::string take(std::string_view name);

 private:
  std::set<std::string, std::less<>> taken_;
};

/// "displayName = ..." where the identifier is not the name; else nothing.
std::string usd_display_name(std::string_view name, std::string_view identifier);

// Numbers have the fewest digits that read back to the same bits.
std::string usd_tuple(const Vec3& v);
std::string usd_tuple(const Quat& q);  ///< w, x, y, z
std::string usd_array(const std::vector<Vec3f>& vectors);
std::string usd_array(const std::vector<Vec2f>& vectors);
std::string usd_array(const std::vector<int>& numbers);
/// Coordinates in [-1, 1] with four digits after the point: for normals, of which nobody sees more.
std::string usd_rounded_array(const std::vector<Vec3f>& vectors);

/// Values of an attribute at frames. One that is the same at all frames has no samples, and of frames in a
/// row with the same value the first and the last have one: values in between are interpolated.
class UsdSamples {
 public:
  void add(int frame, std::string value);
  bool empty() const { return frames_.empty(); }
  std::size_t bytes() const { return bytes_; }
  /// "TYPE NAME = VALUE" or "TYPE NAME.timeSamples = {...}", with the indentation and the end of the line.
  std::string text(std::string_view indent, std::string_view declaration) const;

 private:
  std::vector<int> frames_;
  std::vector<std::string> values_;
  std::size_t bytes_ = 0;
};

}  // namespace duet::io
