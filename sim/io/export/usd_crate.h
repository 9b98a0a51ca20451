// Layers in the binary format of USD ("crate", .usdc): prims with attributes that have a value at one time.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "sim/base/types.h"

namespace duet::io {

/// Value of an attribute: none, double3, quatd, an array of three floats each, or float[].
using UsdData = std::variant<std::monostate, Vec3, Quat, std::vector<Vec3f>, std::vector<float>>;

/// A layer of overrides (`over`) for the prims of another layer, as a file of value clips is. Arrays are
/// stored as they are in memory, without compression. Numbers are little-endian, as those of the processors
/// that Duet is built for.
///
/// The layout is that of version 0.8.0, which USD wrote by default for years: pxr/usd/sdf/crateFile.cpp of
/// OpenUSD (newer releases warn of older versions). The values come first; then sections with the names,
/// fields, paths and specs; and at the end a table of these sections, to which the head of the file points.
class UsdCrate {
 public:
  /// Begins a layer whose values hold at the time code `time`.
  explicit UsdCrate(double time);

  /// Begins a prim in the one that has begun last and has not ended. `name` is an identifier.
  void begin_prim(const std::string& name);
  /// Ends the prim that has begun last.
  void end_prim();
  /// Adds an attribute to the prim that has begun last. `declaration` is "TYPE NAME", and TYPE is one that
  /// has values of the kind of `value`: "double3", "quatd", "float[]", and "point3f[]" and others of three
  /// floats. A value of the first kind (none) adds nothing.
  void add(std::string_view declaration, const UsdData& value);

  /// Ends the layer, and returns the bytes of its file. All prims must have ended.
  std::string finish();

 private:
  // The tree of paths of the layer in depth-first order.
  struct Paths {
    std::vector<std::int32_t> names,  // token of each path's last element; negative for attributes
        jumps;                        // see list_paths()
    std::vector<std::size_t> specs;   // index of each path in specs_
  };
  // The layer, a prim or an attribute.
  struct Spec {
    std::uint32_t name = 0;               // index of its name in tokens_
    std::vector<std::size_t> prims,       // indices of the prims in it in specs_
        attributes;                       // indices of its attributes in specs_
    std::vector<std::int32_t> field_set;  // fields of an attribute, as indices in fields_
    bool is_attribute = false;
  };

  std::uint32_t token(std::string_view text);
  std::int32_t field(std::string_view name, std::uint64_t value);
  std::uint64_t write_value(const UsdData& value);
  std::uint64_t write_names(const std::vector<std::size_t>& specs);
  std::size_t add_spec(std::string_view name);
  void close_prim(std::size_t spec);
  void list_paths(std::size_t spec, bool has_sibling);
  std::string paths_section() const;
  std::string specs_section(std::vector<std::int32_t>& field_sets) const;

  std::string data_;  // the file up to the end of the values
  std::vector<std::string> tokens_;
  std::map<std::string, std::uint32_t, std::less<>> token_indices_;
  std::vector<std::pair<std::uint32_t, std::uint64_t>> fields_;  // name and value representation
  std::map<std::pair<std::uint32_t, std::uint64_t>, std::int32_t> field_indices_;
  std::vector<Spec> specs_;        // the first is that of the layer itself
  std::vector<std::size_t> open_;  // indices of the prims that have begun and not ended
  std::uint64_t times_ = 0;        // value representation of the list of times
  Paths paths_;                    // empty before finish()
};

}  // namespace duet::io
