// The JSON of a GLB file, and the layout of its binary part.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "sim/base/types.h"

namespace duet::io {

/// JSON whose objects keep their keys in the order of insertion.
using Json = nlohmann::ordered_json;

/// Returns the array [x, y, z].
inline Json json_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
/// Returns the array [x, y, z] with the exact values of the floats.
inline Json json_of(const Vec3f& v) { return json_of(Vec3(v.cast<double>())); }

/// Purpose of the arrays in a buffer view. The values are those of glTF's bufferView.target.
enum class ViewUse {
  other = 0,         ///< neither of the others, as for animations: no target is written
  vertices = 34962,  ///< ARRAY_BUFFER: attributes of vertices
  indices = 34963    ///< ELEMENT_ARRAY_BUFFER: indices of triangles
};

/// Choice whether an accessor states the bounds of its values, accessor.min and accessor.max.
enum class Bounds {
  leave_out,  ///< without bounds
  write       ///< with bounds, which glTF demands of positions and of the times of animations
};

/// A glTF document that is being made. Accessors, buffer views and meshes, of which a run has many for each
/// body and frame, are kept as text: as trees of JSON values they would take ten times the memory.
class GlbDocument {
 public:
  /// Returns all of the document but accessors, bufferViews, meshes and buffers, to be filled in.
  Json& json() { return json_; }

  /// Appends scalars or vectors to the binary part and returns the index of their accessor. `values` holds
  /// `components` numbers (1 to 4) for each.
  int add_floats(const std::vector<float>& values, int components, ViewUse use, Bounds bounds);
  /// Appends scalars and returns the index of their accessor. If it takes less room, the accessor is
  /// sparse: a list of the scalars that are not 0.
  int add_sparse_floats(const std::vector<float>& values);
  /// Appends indices of `vertices` vertices and returns the index of their accessor. Indices have 16 bits
  /// if there are fewer than 2^16 vertices, and 32 bits otherwise.
  int add_indices(const std::vector<std::uint32_t>& indices, std::size_t vertices);

  /// Reserves `bytes` bytes at the end of the binary part and returns the index of their buffer view.
  /// `stride` is the distance between vertices in bytes, 0 for none. add_floats(), add_sparse_floats() and
  /// add_indices() must not be called afterwards.
  int reserve_view(std::uint64_t bytes, ViewUse use, int stride);
  /// Adds an accessor, given as the text of a JSON object, and returns its index.
  int add_accessor(const std::string& text) { return accessors_.add(text); }
  /// Adds a mesh, given as the text of a JSON object, and returns its index.
  int add_mesh(const std::string& text) { return meshes_.add(text); }

  /// Returns the bytes of the binary part before the reserved room.
  const std::string& start() const { return start_; }
  /// Returns the length of the binary part with the reserved room, in bytes: a multiple of four.
  std::uint64_t binary_size() const { return size_; }
  /// Returns the text of the document, padded with spaces to a multiple of four bytes as a chunk of a GLB
  /// file.
  std::string text() const;

 private:
  // Entries of a JSON array as text.
  struct List {
    std::string text;
    int count = 0;
    int add(const std::string& entry);
  };

  // Appends bytes to the binary part and returns the index of their buffer view.
  int add_view(const void* data, std::size_t bytes, ViewUse use);

  Json json_ = Json::object();
  List accessors_, views_, meshes_;
  std::string start_;       // bytes of the binary part before the reserved room
  std::uint64_t size_ = 0;  // length of the binary part with the reserved room, bytes
};

/// Returns the JSON array [x,y,z] with the exact values of the floats.
std::string json_text(const Vec3f& v);

/// Returns a JSON string with its quotes. Bytes that are not UTF-8 become U+FFFD.
std::string json_text(const std::string& text);

}  // namespace duet::io
