// Checks that precede the reading of glTF files by Assimp 5.2, which trusts numbers in them.
#pragma once

#include <string>

namespace duet {

/// Throws FileError if the JSON of a .gltf or .glb file nests too deep, or if the lengths in a .glb file are
/// not those of its parts. Assimp would overflow its stack, or take as much memory as the file says.
void check_gltf(const std::string& path);

}  // namespace duet
