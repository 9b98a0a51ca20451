#include "sim/io/export/split_vertices.h"

#include <algorithm>
#include <tuple>

namespace duet::io {
namespace {

// Returns the key by which corners are sorted: those of one position are neighbors.
auto key(const Corner& corner) { return std::tuple(corner.position, corner.normal, corner.uv); }

bool is_before(const Corner& a, const Corner& b) { return key(a) < key(b); }

bool is_equal(const Corner& a, const Corner& b) { return key(a) == key(b); }

// Appends a corner without texture coordinate and normal for each position that no triangle uses.
void add_unused(const Surface& surface, std::vector<Corner>& corners) {
  std::vector<bool> is_used(surface.positions.size());
  for (const Corner& corner : corners) is_used[static_cast<std::size_t>(corner.position)] = true;
  for (std::size_t i = 0; i < is_used.size(); ++i)
    if (!is_used[i]) corners.push_back({static_cast<int>(i), -1, -1});
}

}  // namespace

SplitVertices split_vertices(const Surface& surface, UnusedPositions unused) {
  SplitVertices split;
  for (const std::array<Corner, 3>& triangle : surface.triangles)
    split.vertices.insert(split.vertices.end(), triangle.begin(), triangle.end());
  if (unused == UnusedPositions::kept) add_unused(surface, split.vertices);
  std::sort(split.vertices.begin(), split.vertices.end(), is_before);
  split.vertices.erase(std::unique(split.vertices.begin(), split.vertices.end(), is_equal),
                       split.vertices.end());
  split.indices.reserve(3 * surface.triangles.size());
  for (const std::array<Corner, 3>& triangle : surface.triangles)
    for (const Corner& corner : triangle) {
      const auto place = std::lower_bound(split.vertices.begin(), split.vertices.end(), corner, is_before);
      split.indices.push_back(static_cast<std::uint32_t>(place - split.vertices.begin()));
    }
  return split;
}

bool SplitVertices::keeps_positions(std::size_t positions) const {
  if (vertices.size() != positions) return false;
  for (std::size_t i = 0; i < positions; ++i)
    if (static_cast<std::size_t>(vertices[i].position) != i) return false;
  return true;
}

}  // namespace duet::io
