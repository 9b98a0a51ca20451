// Names of the files that a .gltf file refers to.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace duet {

/// Returns the text with each "%20", a percent sign and two hexadecimal digits, replaced by the byte that it
/// stands for. Other percent signs, and "%00", stay as they are.
std::string percent_decoded(std::string_view text);

/// Returns the path, relative to `folder`, of the file that a URI of a .gltf file in this folder names. URIs
/// are percent-encoded (glTF 2.0, section 2.8); many programs write the plain name. So the URI itself is the
/// path if there is such a file.
std::string path_of_uri(const std::filesystem::path& folder, const std::string& uri);

}  // namespace duet
