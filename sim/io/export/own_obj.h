// An OBJ file of the user with other positions of its vertices.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/base/types.h"
#include "sim/io/text_builder.h"

namespace duet::io {

/// A body in an OBJ file of several bodies, made of an OBJ file of the user. Polygons, texture coordinates,
/// groups, smoothing groups and materials stay, positions are replaced at each frame.
class OwnObj {
 public:
  /// Reads `text`, which is an OBJ file as obj_statements() returns it. In the file to be written,
  /// `vertices_before` vertices and `uvs_before` texture coordinates come before this body. Its first
  /// object is called `body`, or the part before its first object if there are vertices or faces in it;
  /// other objects are called "body.name". `material` returns the name to write for each `usemtl`, given
  /// its name, and for faces before any `usemtl`, given an empty name; an empty result writes no `usemtl`.
  /// As in the format, a positive index counts from the first vertex of the whole file, also one that comes
  /// after the face, and a negative index counts back from the last vertex before the face. Normals are
  /// left out, because they belong to the positions of `text`. Points, lines and comments are left out,
  /// too. Faces whose indices are out of range are written as far as possible: see damaged_faces().
  OwnObj(std::string_view text, const std::string& body, int vertices_before, int uvs_before,
         const std::function<std::string(const std::string&)>& material);

  /// Returns the number of vertices of the body.
  int vertices() const { return vertices_; }
  /// Returns the number of texture coordinates of the body.
  int uvs() const { return uvs_; }
  /// Returns the number of faces with an index that the file has no element for. A face without one of its
  /// vertices is left out; a face without one of its texture coordinates is written without all of them.
  int damaged_faces() const { return damaged_faces_; }

  /// Appends the body to the text. `order` gives for each vertex the index of its position in `positions`,
  /// as OwnMesh::positions does.
  void add(TextBuilder& text, const std::vector<Vec3>& positions, const std::vector<int>& order) const;

 private:
  void read_line(std::string_view line);
  // Appends a face to faces_ with indices for the file to be written, or counts it as damaged.
  void add_face(std::string_view corners);
  // Begins the faces before any `usemtl` with the material for an empty name.
  void begin_faces();

  std::string body_;
  int vertices_before_, uvs_before_;
  std::function<std::string(const std::string&)> material_;
  int vertices_ = 0, uvs_ = 0;                // numbers of elements in the file
  int vertices_so_far_ = 0, uvs_so_far_ = 0;  // numbers of elements read before the present line
  int objects_ = 0, faces_so_far_ = 0;        // numbers of statements read before the present line
  int damaged_faces_ = 0;                     // see damaged_faces()
  bool has_material_ = false;                 // true once a material has been chosen
  std::string uv_lines_;                      // lines of the texture coordinates
  std::string faces_;                         // lines of faces, groups, objects and materials
};

}  // namespace duet::io
