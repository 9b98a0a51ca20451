// The cache of tetrahedra that fill meshes, which persists from one command to the next.
#pragma once

#include <filesystem>

namespace duet::tools {

// Returns the folder of the cache: $DUET_CACHE, else duet/ in $XDG_CACHE_HOME, else duet/ in ~/.cache. The
// path is empty if DUET_CACHE=off or none of these variables is set.
std::filesystem::path cache_folder();

// Lets this process read and write the cache. A program that was built with uncommitted changes leaves the
// cache alone: another program with the same commit could fill meshes differently.
void use_cache();

}  // namespace duet::tools
