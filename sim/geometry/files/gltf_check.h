// Checks that precede the reading of glTF files by Assimp 5.2, which trusts numbers in them.
#pragma once

#include <string>

namespace duet {

/// Throws FileError if the JSON or the nodes of a .gltf or .glb file nest too deep, if its nodes form no tree
/// of a size that Assimp can make, or if the lengths in a .glb file are not those of its parts. Assimp would
/// overflow its stack, or take as much memory as the file says.
void check_gltf(const std::string& path);

}  // namespace duet
