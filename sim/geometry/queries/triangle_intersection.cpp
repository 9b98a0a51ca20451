#include "sim/geometry/queries/triangle_intersection.h"

#include <algorithm>
#include <numeric>

#include "sim/base/parallel.h"
#include "sim/geometry/mesh/orientation.h"
#include "sim/geometry/queries/box_tree.h"

namespace duet {
namespace {

// Triangles per chunk of a parallel loop.
constexpr std::size_t triangle_grain = 256;

// Returns whether `x`, a point of the line pq, lies between p and q.
bool on_segment(const Vec2& p, const Vec2& q, const Vec2& x) {
  return (x.array() >= p.array().min(q.array())).all() && (x.array() <= p.array().max(q.array())).all();
}

// Returns whether the segments pq and ab of the plane have a point in common.
bool segments_meet(const Vec2& p, const Vec2& q, const Vec2& a, const Vec2& b) {
  const int pa = orientation(p, q, a), pb = orientation(p, q, b), ap = orientation(a, b, p),
            aq = orientation(a, b, q);
  if (pa * pb < 0 && ap * aq < 0) return true;
  return (pa == 0 && on_segment(p, q, a)) || (pb == 0 && on_segment(p, q, b)) ||
         (ap == 0 && on_segment(a, b, p)) || (aq == 0 && on_segment(a, b, q));
}

using Corners = std::array<Vec3, 3>;

// Returns whether a segment in the plane of a triangle meets it. The test uses a projection along an axis
// that keeps the area of the triangle.
bool coplanar_segment_meets(const Vec3& p, const Vec3& q, const Corners& triangle) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto projected = [&](const Vec3& x) { return Vec2(x[(axis + 1) % 3], x[(axis + 2) % 3]); };
    const Vec2 a = projected(triangle[0]), b = projected(triangle[1]), c = projected(triangle[2]),
               u = projected(p), v = projected(q);
    const int turn = orientation(a, b, c);
    if (turn == 0) continue;
    const bool inside =
        orientation(a, b, u) != -turn && orientation(b, c, u) != -turn && orientation(c, a, u) != -turn;
    return inside || segments_meet(u, v, a, b) || segments_meet(u, v, b, c) || segments_meet(u, v, c, a);
  }
  return false;
}

// Returns whether the segment pq meets a triangle.
bool segment_meets(const Vec3& p, const Vec3& q, const Corners& triangle) {
  const auto& [a, b, c] = triangle;
  const int side_p = orientation(a, b, c, p), side_q = orientation(a, b, c, q);
  if (side_p * side_q > 0) return false;
  if (side_p == 0 && side_q == 0) return coplanar_segment_meets(p, q, triangle);
  const int ab = orientation(p, q, a, b), bc = orientation(p, q, b, c), ca = orientation(p, q, c, a);
  return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

// Returns whether an edge of the first triangle meets the second one.
bool an_edge_meets(const Corners& first, const Corners& second) {
  return segment_meets(first[0], first[1], second) || segment_meets(first[1], first[2], second) ||
         segment_meets(first[2], first[0], second);
}

bool share_vertex(const Triangle& a, const Triangle& b) {
  return std::any_of(a.begin(), a.end(), [&](int v) { return std::find(b.begin(), b.end(), v) != b.end(); });
}

}  // namespace

bool triangles_meet(const std::array<Vec3, 3>& first, const std::array<Vec3, 3>& second) {
  return an_edge_meets(first, second) || an_edge_meets(second, first);
}

std::vector<std::array<int, 2>> intersecting_triangles(const std::vector<Vec3>& positions,
                                                       std::span<const Triangle> triangles) {
  const auto corners = [&](std::size_t t) {
    return Corners{positions[as_index(triangles[t][0])], positions[as_index(triangles[t][1])],
                   positions[as_index(triangles[t][2])]};
  };
  std::vector<Eigen::AlignedBox3d> boxes(triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const Vec3& corner : corners(t)) boxes[t].extend(corner);
  std::vector<int> all(triangles.size());
  std::iota(all.begin(), all.end(), 0);
  BoxTree tree;
  tree.build(boxes, all);

  // For each triangle, those of larger index that it meets.
  std::vector<std::vector<int>> partners(triangles.size());
  parallel_for(triangles.size(), triangle_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      tree.query(boxes[t], [&](int other) {
        if (as_index(other) > t && !share_vertex(triangles[t], triangles[as_index(other)]) &&
            triangles_meet(corners(t), corners(as_index(other))))
          partners[t].push_back(other);
      });
      std::sort(partners[t].begin(), partners[t].end());
    }
  });
  std::vector<std::array<int, 2>> pairs;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (int other : partners[t]) pairs.push_back({static_cast<int>(t), other});
  return pairs;
}

}  // namespace duet
