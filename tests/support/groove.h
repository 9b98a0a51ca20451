// A mesh that is not convex: a long body with a V-shaped groove along its top.
#pragma once

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/support/meshes.h"

namespace duet::test {

// Returns a body of 20 m x 2 m along x with its groove at the origin. The sides of the groove rise at `angle`
// (rad).
inline TriangleMesh groove(double angle) {
  const double length = 20, half = 1, rise = half * std::tan(angle), below = -0.5;
  TriangleMesh mesh;
  for (const double x : {-length / 2, length / 2})
    for (const auto& [y, z] : {std::pair(rise, -half), std::pair(0.0, 0.0), std::pair(rise, half),
                               std::pair(below, half), std::pair(below, 0.0), std::pair(below, -half)})
      mesh.positions.emplace_back(x, y, z);
  for (int i = 0; i < 6; ++i) {
    const int next = (i + 1) % 6;
    add_face(mesh, {i, next, next + 6, i + 6});
  }
  for (const int end : {0, 6})
    for (const std::vector<int>& cap : {std::vector<int>{0, 5, 4, 1}, std::vector<int>{1, 4, 3, 2}}) {
      std::vector<int> face;
      for (const int i : cap) face.push_back(i + end);
      if (end == 6) std::reverse(face.begin(), face.end());
      add_face(mesh, face);
    }
  return mesh;
}

}  // namespace duet::test
