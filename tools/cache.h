// Tetrahedra of meshes that are kept from one command to the next.
#pragma once

#include <filesystem>

namespace duet::tools {

/// $DUET_CACHE, or duet/ in $XDG_CACHE_HOME or ~/.cache; empty where DUET_CACHE=off, or where there is no
/// such folder to name.
std::filesystem::path cache_folder();

/// Keeps the tetrahedra of this command's meshes there. A program with changes that are not committed keeps
/// none: others with the same commit could fill otherwise.
void use_cache();

}  // namespace duet::tools
