#include "sim/scene/build/tet_cache.h"

#include <algorithm>
#include <cstring>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/base/hash.h"

namespace duet::scene {
namespace {

namespace fs = std::filesystem;

constexpr const char* ending = ".tets";  // of the names of the files

TetCache& cache() {
  static TetCache the_cache;
  return the_cache;
}

// The beginning of a file. Nodes and tetrahedra follow it; `hash` is the hash of their bytes.
struct Head {
  std::array<char, 8> magic = {'d', 'u', 'e', 't', 't', 'e', 't', '1'};
  TetKey key{};
  std::uint64_t nodes = 0, tets = 0, hash = 0;
};

fs::path path_of(const TetKey& key) {
  return cache().folder / fmt::format("{:016x}{:016x}{}", key[0], key[1], ending);
}

// Returns the files of the cache in `folder`; none if it cannot be read.
std::vector<fs::directory_entry> files_of(const fs::path& folder) {
  std::vector<fs::directory_entry> files;
  std::error_code unreadable;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, unreadable))
    if (entry.path().extension() == ending && entry.is_regular_file(unreadable)) files.push_back(entry);
  return files;
}

// Returns the mesh that the bytes of a file hold; none if they are damaged or belong to another key.
std::optional<TetMesh> parse(const std::string& bytes, const TetKey& key) {
  Head head;
  const Head expected;
  if (bytes.size() < sizeof head) return std::nullopt;
  std::memcpy(&head, bytes.data(), sizeof head);
  const std::size_t body = bytes.size() - sizeof head;
  if (head.magic != expected.magic || head.key != key || head.nodes > body / sizeof(Vec3) ||
      head.tets > body / sizeof(Tet) || head.nodes * sizeof(Vec3) + head.tets * sizeof(Tet) != body ||
      hash_bytes(bytes.data() + sizeof head, body) != head.hash)
    return std::nullopt;
  TetMesh mesh;
  mesh.nodes.resize(head.nodes);
  mesh.tets.resize(head.tets);
  const char* from = bytes.data() + sizeof head;
  std::memcpy(static_cast<void*>(mesh.nodes.data()), from, head.nodes * sizeof(Vec3));
  std::memcpy(mesh.tets.data(), from + head.nodes * sizeof(Vec3), head.tets * sizeof(Tet));
  return mesh;
}

// Removes the least recently used files until the others fit into TetCache::max_bytes.
void make_room() {
  std::error_code ignored;
  std::vector<std::pair<fs::file_time_type, fs::directory_entry>> files;
  std::uintmax_t bytes = 0;
  for (const fs::directory_entry& entry : files_of(cache().folder)) {
    files.emplace_back(entry.last_write_time(ignored), entry);
    bytes += entry.file_size(ignored);
  }
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [time, entry] : files) {
    if (bytes <= cache().max_bytes) return;
    bytes -= std::min(bytes, entry.file_size(ignored));
    fs::remove(entry.path(), ignored);
  }
}

}  // namespace

void set_tet_cache(TetCache new_cache) { cache() = std::move(new_cache); }

TetKey tet_key(const TriangleMesh& mesh, double scale, std::optional<double> spacing, bool graded) {
  TetKey key;
  for (std::size_t i = 0; i < key.size(); ++i) {
    std::uint64_t hash = hash_seed + i;
    const auto add = [&](const void* data, std::size_t size) { hash = hash_bytes(data, size, hash); };
    const std::uint64_t counts[] = {mesh.positions.size(), mesh.triangles.size(), spacing ? 1U : 0U,
                                    graded ? 1U : 0U};
    const double numbers[] = {scale, spacing.value_or(0)};
    add(counts, sizeof counts);
    add(numbers, sizeof numbers);
    add(mesh.positions.data(), mesh.positions.size() * sizeof(Vec3));
    add(mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle));
    add(cache().program.data(), cache().program.size());
    key[i] = hash;
  }
  return key;
}

std::optional<TetMesh> cached_tets(const TetKey& key) {
  if (cache().folder.empty()) return std::nullopt;
  const fs::path path = path_of(key);
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) return std::nullopt;
  try {
    std::optional<TetMesh> mesh = parse(io::read_file(path), key);
    if (mesh)
      fs::last_write_time(path, fs::file_time_type::clock::now(), ignored);
    else
      fs::remove(path, ignored);
    return mesh;
  } catch (const Error&) {
    return std::nullopt;
  }
}

void keep_tets(const TetKey& key, const TetMesh& mesh) {
  if (cache().folder.empty()) return;
  std::string body(reinterpret_cast<const char*>(mesh.nodes.data()), mesh.nodes.size() * sizeof(Vec3));
  body.append(reinterpret_cast<const char*>(mesh.tets.data()), mesh.tets.size() * sizeof(Tet));
  Head head;
  head.key = key;
  head.nodes = mesh.nodes.size();
  head.tets = mesh.tets.size();
  head.hash = hash_bytes(body.data(), body.size());
  try {
    io::create_folder(cache().folder);
    io::write_atomically(path_of(key), std::string(reinterpret_cast<const char*>(&head), sizeof head) + body);
    make_room();
  } catch (const Error&) {
  }
}

TetCacheSize tet_cache_size(const fs::path& folder) {
  TetCacheSize size;
  std::error_code ignored;
  for (const fs::directory_entry& entry : files_of(folder)) {
    ++size.files;
    size.bytes += entry.file_size(ignored);
  }
  return size;
}

TetCacheSize clear_tet_cache(const fs::path& folder) {
  const TetCacheSize size = tet_cache_size(folder);
  for (const fs::directory_entry& entry : files_of(folder)) io::remove_file(entry.path());
  return size;
}

}  // namespace duet::scene
