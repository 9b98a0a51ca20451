/// The JSON of a GLB file, and where its binary part holds what.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "sim/base/types.h"

namespace duet::io {

using Json = nlohmann::ordered_json;

inline Json json_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
inline Json json_of(const Vec3f& v) { return json_of(Vec3(v.cast<double>())); }

/// The purpose of the arrays in a buffer view: the numbers of glTF's bufferView.target.
enum class ViewUse { other = 0, vertices = 34962, indices = 34963 };

enum class Bounds { leave_out, write };  ///< accessor.min and .max

/// A glTF document in the making. Arrays of which a run has one a body and frame are kept as text: as trees
/// of JSON values they would take ten times the memory.
class GlbDocument {
 public:
  /// All of the document but accessors, bufferViews, meshes and buffers.
  Json& json() { return json_; }

  /// Appends the values to the binary part and returns the index of their accessor. `components`: 1 to 4 a
  /// value.
  int add_floats(const std::vector<float>& values, int components, ViewUse use, Bounds bounds);
  /// Appends scalars as add_floats does, or as a list of those that are not 0 where that takes less room.
  int add_sparse_floats(const std::vector<float>& values);
  int add_indices(const std::vector<std::uint32_t>& indices, std::size_t vertices);

  /// Reserves room at the end of the binary part and returns the index of its buffer view. add_floats,
  /// add_sparse_floats and add_indices must not be called afterwards. `stride`: 0 for none.
  int reserve_view(std::uint64_t bytes, ViewUse use, int stride);
  /// The text is an object of JSON. Each returns the index of what it adds.
  int add_accessor(const std::string& text) { return accessors_.add(text); }
  int add_mesh(const std::string& text) { return meshes_.add(text); }

  /// The bytes of the binary part up to what was reserved.
  const std::string& start() const { return start_; }
  std::uint64_t binary_size() const { return size_; }
  /// The document with its buffer, padded with spaces to a multiple of four bytes.
  std::string text() const;

 private:
  struct List {
    std::string text;
    int count = 0;
    int add(const std::string& entry);
  };

  int add_view(const void* data, std::size_t bytes, ViewUse use);

  Json json_ = Json::object();
  List accessors_, views_, meshes_;
  std::string start_;
  std::uint64_t size_ = 0;
};

/// "[x, y, z]" of floats, exact.
std::string json_text(const Vec3f& v);

/// A string of JSON with its quotes; bytes that are no UTF-8 become U+FFFD.
std::string json_text(const std::string& text);

}  // namespace duet::io
