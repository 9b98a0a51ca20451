/// An OBJ file of the user's with other positions: its polygons, texture coordinates, groups and materials
/// stay.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "sim/base/types.h"
#include "sim/io/text_builder.h"

namespace duet::io {

class OwnObj {
 public:
  /// Takes over the text of an OBJ file for a file of several bodies, in which `vertices_before` vertices and
  /// `uvs_before` texture coordinates stand before. What comes before any object of the file, or
  /// else its first one, is called `body`, all others "body.name". `material` gives the name for each
  /// `usemtl` and, with an empty one, that of faces before any. Normals are left out, as they would be those
  /// of the file's own positions; so are points, lines and comments. Faces that name vertices the file does
  /// not have are left out, too.
  OwnObj(std::string_view text, const std::string& body, int vertices_before, int uvs_before,
         const std::function<std::string(const std::string&)>& material);

  int vertices() const { return vertices_; }
  int uvs() const { return uvs_; }

  /// The part of the file for this body, with the vertices at these positions.
  void add(TextBuilder& text, const std::vector<Vec3>& positions, const std::vector<int>& order) const;

 private:
  void read_line(std::string_view line);
  void add_face(std::string_view corners);
  void begin_faces();

  std::string body_;
  int vertices_before_, uvs_before_;
  std::function<std::string(const std::string&)> material_;
  int vertices_ = 0, uvs_ = 0, objects_ = 0;
  bool has_material_ = false;
  std::string tail_;  // what stands after the vertices
};

}  // namespace duet::io
