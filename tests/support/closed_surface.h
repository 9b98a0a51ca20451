// Tests whether the boundary triangles of a tetrahedral mesh form a closed manifold.
#pragma once

#include <map>
#include <vector>

#include "sim/geometry/mesh/tet_mesh.h"

namespace duet::test {

// Returns whether the triangles are closed and manifold: every edge belongs to two triangles that run through
// it in opposite directions, and the triangles around every node form one fan. False without triangles.
inline bool is_closed_manifold(const std::vector<Triangle>& triangles) {
  std::map<std::pair<int, int>, int> edges;
  std::map<int, std::map<int, int>> fans;  // by the node: each neighbor, and the next one around the node
  for (const Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      ++edges[{t[k], t[(k + 1) % 3]}];
      fans[t[k]][t[(k + 1) % 3]] = t[(k + 2) % 3];
    }
  for (const auto& [edge, count] : edges)
    if (count != 1 || !edges.contains({edge.second, edge.first})) return false;
  for (const auto& [node, next] : fans) {
    std::size_t length = 1;
    for (int at = next.begin()->second; at != next.begin()->first; at = next.at(at)) ++length;
    if (length != next.size()) return false;
  }
  return !triangles.empty();
}

}  // namespace duet::test
