#include "sim/deformable/self_contact/collision_surface.h"

#include <algorithm>

#include "sim/base/assert.h"

namespace duet {
namespace {

// Returns every edge once, from the smaller to the larger index, in ascending order.
std::vector<std::array<int, 2>> edges_of(std::span<const Triangle> surface,
                                         std::span<const std::array<int, 2>> segments) {
  std::vector<std::array<int, 2>> edges(segments.begin(), segments.end());
  for (const Triangle& t : surface)
    for (std::size_t k = 0; k < 3; ++k) edges.push_back({t[k], t[(k + 1) % 3]});
  for (std::array<int, 2>& edge : edges) std::sort(edge.begin(), edge.end());
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

}  // namespace

void CollisionSurface::add(const CollisionBody& body, std::span<const Triangle> surface,
                           std::span<const std::array<int, 2>> segments) {
  DUET_ASSERT(body.thickness > 0 && body.friction >= 0);
  const int index = static_cast<int>(bodies.size());
  bodies.push_back(body);
  triangles.insert(triangles.end(), surface.begin(), surface.end());
  triangle_body.resize(triangles.size(), index);
  const std::size_t first_point = points.size();
  for (const std::array<int, 2>& edge : edges_of(surface, segments)) {
    edges.push_back(edge);
    for (int p : edge) points.push_back({p});
  }
  edge_body.resize(edges.size(), index);
  const auto begin = points.begin() + static_cast<std::ptrdiff_t>(first_point);
  std::sort(begin, points.end());
  points.erase(std::unique(begin, points.end()), points.end());
  point_body.resize(points.size(), index);
}

void CollisionSurface::finish(const std::vector<Vec3>& x) {
  initial = x;
  edges_around = elements_around(x.size(), edges, [](const std::array<int, 2>& edge) { return edge; });
}

double shortest_edge(const std::vector<Vec3>& x, std::span<const Triangle> surface,
                     std::span<const std::array<int, 2>> segments) {
  double shortest = 0;
  for (const auto& [a, b] : edges_of(surface, segments)) {
    const double length = (x[static_cast<std::size_t>(a)] - x[static_cast<std::size_t>(b)]).norm();
    shortest = shortest > 0 ? std::min(shortest, length) : length;
  }
  return shortest;
}

}  // namespace duet
