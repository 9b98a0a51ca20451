#include "sim/geometry/queries/triangle_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "sim/base/assert.h"
#include "sim/base/dot_in_order.h"
#include "sim/geometry/queries/closest_points.h"

namespace duet {
namespace {

// Greatest number of triangles of a leaf.
constexpr int leaf_size = 4;
// Bound on the depth of the tree: every split halves the number of triangles.
constexpr std::size_t max_levels = 64;

}  // namespace

Vec3 nearest_point(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x) {
  const Vec3 weight = nearest_weights(a, b, c, x);
  return weight[0] * a + weight[1] * b + weight[2] * c;
}

TriangleTree::TriangleTree(const TriangleMesh& mesh) {
  DUET_ASSERT(!mesh.triangles.empty());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    triangles_.push_back({mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2), static_cast<int>(t)});
  build(0, static_cast<int>(triangles_.size()));
  std::vector<Eigen::AlignedBox3d> boxes;
  for (std::size_t first = 0; first < triangles_.size(); first += pack_width) {
    TrianglePack& pack = packs_.emplace_back();
    Eigen::AlignedBox3d& box = boxes.emplace_back();
    for (std::size_t lane = 0; lane < pack_width; ++lane) {  // lanes without a triangle repeat the last one
      const Corners& t = triangles_[std::min(first + lane, triangles_.size() - 1)];
      pack.set(lane, t.a, t.b, t.c);
      box.extend(t.a).extend(t.b).extend(t.c);
    }
  }
  std::vector<int> all(packs_.size());
  std::iota(all.begin(), all.end(), 0);
  pack_tree_.build(boxes, all);
}

void TriangleTree::build(int begin, int end) {
  const std::size_t node = nodes_.size();
  nodes_.emplace_back();
  Eigen::AlignedBox3d box, centers;
  for (int i = begin; i < end; ++i) {
    const Corners& t = triangles_[as_index(i)];
    box.extend(t.a).extend(t.b).extend(t.c);
    centers.extend(t.a + t.b + t.c);
  }
  nodes_[node].box = box;
  if (end - begin <= leaf_size) {
    // The order that std::nth_element leaves within its halves is not specified; sorting fixes it.
    std::sort(triangles_.begin() + begin, triangles_.begin() + end,
              [](const Corners& s, const Corners& t) { return s.number < t.number; });
    nodes_[node].begin = begin;
    nodes_[node].end = end;
    return;
  }
  int axis = 0;
  centers.sizes().maxCoeff(&axis);
  const int middle = begin + (end - begin) / 2;
  std::nth_element(triangles_.begin() + begin, triangles_.begin() + middle, triangles_.begin() + end,
                   [axis](const Corners& s, const Corners& t) {
                     const double at_s = s.a[axis] + s.b[axis] + s.c[axis],
                                  at_t = t.a[axis] + t.b[axis] + t.c[axis];
                     return at_s != at_t ? at_s < at_t : s.number < t.number;
                   });
  build(begin, middle);
  nodes_[node].second = static_cast<int>(nodes_.size());
  build(middle, end);
}

TriangleTree::Nearest TriangleTree::nearest(const Vec3& x) const {
  DUET_ASSERT(!nodes_.empty());
  struct Pending {
    int node;
    double squared;  // squared distance to its box, m^2
  };
  std::array<Pending, max_levels> stack;
  std::size_t size = 0;
  stack[size++] = {0, nodes_[0].box.squaredExteriorDistance(x)};
  double least = std::numeric_limits<double>::infinity();
  Vec3 point = x;
  int triangle = 0;
  while (size > 0) {
    const Pending next = stack[--size];
    if (next.squared >= least) continue;
    const Node& node = nodes_[as_index(next.node)];
    for (int i = node.begin; i < node.end; ++i) {
      const Corners& t = triangles_[as_index(i)];
      const Vec3 candidate = nearest_point(t.a, t.b, t.c, x);
      if (const double squared = square_in_order(candidate - x); squared < least) {
        least = squared;
        point = candidate;
        triangle = t.number;
      }
    }
    if (node.begin != node.end) continue;
    Pending near{next.node + 1, nodes_[as_index(next.node + 1)].box.squaredExteriorDistance(x)};
    Pending far{node.second, nodes_[as_index(node.second)].box.squaredExteriorDistance(x)};
    if (far.squared < near.squared) std::swap(near, far);
    stack[size++] = far;
    stack[size++] = near;
  }
  return {point, std::sqrt(least), triangle};
}

TriangleTree::Nearest TriangleTree::nearest(const Vec3& x, double at_most) const {
  constexpr double slack = 1 + 1e-9;  // covers rounding of the squared bound
  double least = at_most * at_most * slack;
  std::size_t nearest = triangles_.size();
  pack_tree_.query_near(x, least, [&](int number) {
    const double8 squared = packs_[as_index(number)].squared_distances(x);
    for (unsigned lanes = lanes_of(squared < least); lanes != 0; lanes &= lanes - 1) {
      const auto lane = static_cast<std::size_t>(__builtin_ctz(lanes));
      if (!(squared[lane] < least)) continue;
      least = squared[lane];
      nearest = as_index(number) * pack_width + lane;
    }
  });
  if (nearest >= triangles_.size()) return this->nearest(x);  // no triangle is within the bound
  const Corners& t = triangles_[nearest];
  return {nearest_point(t.a, t.b, t.c, x), std::sqrt(least), t.number};
}

}  // namespace duet
