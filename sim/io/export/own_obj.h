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
  /// object is called `body`, or the part before its first object if there are vertices in it; other
  /// objects are called "body.name". `material` returns the name to write for each `usemtl`, given its
  /// name, and for faces before any `usemtl`, given an empty name; an empty result writes no `usemtl`.
  /// Normals are left out, because they belong to the positions of `text`. Points, lines, comments, and
  /// faces with vertices that the file does not have so far are left out, too.
  OwnObj(std::string_view text, const std::string& body, int vertices_before, int uvs_before,
         const std::function<std::string(const std::string&)>& material);

  /// Returns the number of vertices of the body.
  int vertices() const { return vertices_; }
  /// Returns the number of texture coordinates of the body.
  int uvs() const { return uvs_; }

  /// Appends the body to the text. `order` gives for each vertex the index of its position in `positions`,
  /// as OwnMesh::positions does.
  void add(TextBuilder& text, const std::vector<Vec3>& positions, const std::vector<int>& order) const;

 private:
  void read_line(std::string_view line);
  // Appends a face to tail_ with indices for the file to be written, unless a vertex of it is not there.
  void add_face(std::string_view corners);
  // Begins the faces before any `usemtl` with the material for an empty name.
  void begin_faces();

  std::string body_;
  int vertices_before_, uvs_before_;
  std::function<std::string(const std::string&)> material_;
  int vertices_ = 0, uvs_ = 0, objects_ = 0;  // numbers of statements read so far
  bool has_material_ = false;                 // true once a material has been chosen
  std::string tail_;                          // text after the lines of the vertices
};

}  // namespace duet::io
