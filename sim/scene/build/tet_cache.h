/// Tetrahedra that fill a mesh, kept in files from one command to the next: filling a mesh of 65,000
/// triangles takes seconds.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "sim/geometry/mesh/tet_mesh.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet::scene {

/// Where tetrahedra are kept, and how much. Nothing is kept before set_tet_cache.
struct TetCache {
  std::filesystem::path folder;  ///< made when the first file is written
  std::string program;           ///< names the build; another one fills meshes anew
  std::uintmax_t most_bytes = std::uintmax_t{1}
                              << 30;  ///< of all files; those that were not used for longest go first
};

/// For all meshes that this process fills from now on. To be called before threads are at work.
void set_tet_cache(TetCache cache);

/// What a filling depends on: hash of the mesh's coordinates and triangles, of its parameters, and of the
/// program.
using TetKey = std::array<std::uint64_t, 2>;
TetKey tet_key(const TriangleMesh& mesh, double scale, std::optional<double> spacing, bool graded);

/// The tetrahedra of the key, to the last bit as they were kept; none where there are none, or where their
/// file is damaged, which is then removed. A cache that cannot be read is as good as none.
std::optional<TetMesh> cached_tets(const TetKey& key);

/// Keeps them. A cache that cannot be written is as good as none.
void keep_tets(const TetKey& key, const TetMesh& mesh);

/// The files of the cache, and their bytes together.
struct TetCacheSize {
  int files = 0;
  std::uintmax_t bytes = 0;
};
TetCacheSize tet_cache_size(const std::filesystem::path& folder);

/// Removes them; other files in the folder stay. Throws FileError where one cannot be removed.
TetCacheSize clear_tet_cache(const std::filesystem::path& folder);

}  // namespace duet::scene
