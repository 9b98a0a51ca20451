// Caches the tetrahedra that fill a mesh in files, from one command to the next: filling a mesh of 65,000
// triangles takes seconds.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "sim/geometry/mesh/tet_mesh.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet::scene {

/// Settings of the cache: its folder, its size and the program that uses it. Nothing is cached before
/// set_tet_cache().
struct TetCache {
  std::filesystem::path folder;  ///< Folder, made when the first file is written; empty: no cache.
  std::string program;           ///< Name of the build; another build does not use its files.
  /// Largest total size of the files, bytes, 1 GiB by default. The least recently used files are removed
  /// first.
  std::uintmax_t max_bytes = std::uintmax_t{1} << 30;
};

/// Sets the cache for all meshes that this process fills from now on. It must be called before other threads
/// use the cache.
void set_tet_cache(TetCache cache);

/// Hash of all that a filling depends on, two words of 64 bits.
using TetKey = std::array<std::uint64_t, 2>;
/// Returns the key of filling `mesh`, scaled by `scale`, with tetrahedra of `spacing` (m; none: the default),
/// `graded` or not, by this program.
TetKey tet_key(const TriangleMesh& mesh, double scale, std::optional<double> spacing, bool graded);

/// Returns the cached tetrahedra of the key, bit-identical to those that were written. Returns none if there
/// are none, if the cache cannot be read, or if their file is damaged, which is then removed.
std::optional<TetMesh> cached_tets(const TetKey& key);

/// Writes the tetrahedra of the key to the cache, then removes old files if it is too large. Does nothing if
/// the cache cannot be written.
void keep_tets(const TetKey& key, const TetMesh& mesh);

/// Size of a cache.
struct TetCacheSize {
  int files = 0;             ///< Number of files.
  std::uintmax_t bytes = 0;  ///< Total size of the files, bytes.
};
/// Returns the size of the cache in `folder`; 0 if there is no such folder.
TetCacheSize tet_cache_size(const std::filesystem::path& folder);

/// Removes the files of the cache in `folder` and returns their size before; other files stay. Throws
/// FileError if one cannot be removed.
TetCacheSize clear_tet_cache(const std::filesystem::path& folder);

}  // namespace duet::scene
