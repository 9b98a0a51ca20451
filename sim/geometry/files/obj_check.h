// Finds what is wrong with an OBJ file, for messages.
#pragma once

#include <string>
#include <string_view>

namespace duet {

/// Throws FileError with the line of the first face of an OBJ file that has fewer than three corners, or an
/// index that is no number, or that names none of the vertices, texture coordinates or normals. Returns if
/// there is none. `text` is the text of the file at `path`.
void check_obj_faces(const std::string& path, std::string_view text);

}  // namespace duet
