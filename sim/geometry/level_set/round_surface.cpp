#include "sim/geometry/level_set/round_surface.h"

#include <map>
#include <queue>
#include <utility>

#include "sim/base/index.h"
#include "sim/geometry/mesh/sharp_edge.h"

namespace duet {
namespace {

// 1 - cosine of the angle between faces that count as one plane: 0.08 degrees. In finer meshes all vertices
// are flat, and samples between which nothing protrudes are enough.
constexpr double same_plane_of_faces = 1e-6;

// What meets at a vertex of a mesh.
struct Around {
  bool is_sharp = false;  // at least one edge is sharp, or has not two faces
  bool is_flat = true;    // all edges lie between faces of one plane
  std::vector<int> neighbors;
};

// Returns what meets at each vertex of a mesh.
std::vector<Around> look_around(const TriangleMesh& mesh) {
  struct Sides {
    Vec3 normal = Vec3::Zero();  // of the first face
    double cosine = 1;           // between the normals of the first two faces
    int faces = 0;
  };
  std::map<std::pair<int, int>, Sides> edges;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 normal = area_vector(mesh, t).normalized();
    const Triangle& corners = mesh.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      Sides& sides = edges[std::minmax(corners[k], corners[(k + 1) % 3])];
      if (sides.faces == 0) sides.normal = normal;
      if (sides.faces == 1) sides.cosine = sides.normal.dot(normal);
      ++sides.faces;
    }
  }
  std::vector<Around> around(mesh.positions.size());
  for (const auto& [ends, sides] : edges)
    for (const auto& [v, other] : {ends, std::pair(ends.second, ends.first)}) {
      Around& here = around[as_index(v)];
      here.is_sharp |= sides.faces != 2 || sides.cosine < sharp_edge;
      here.is_flat &= 1 - sides.cosine < same_plane_of_faces;
      here.neighbors.push_back(other);
    }
  return around;
}

// Divides the vertices among the samples, by rounds of neighbors that begin at all samples at once, and sets
// RoundSurface::patch and reach. Vertices that no sample reaches get the patch -1.
void divide(RoundSurface& surface) {
  surface.patch.assign(surface.vertices.size(), -1);
  surface.reach.assign(surface.vertices.size(), 0);
  std::queue<int> open;
  for (const RoundSample& sample : surface.at_sample) {
    const int start = sample.patch;
    if (start < 0) continue;
    surface.patch[as_index(start)] = start;
    open.push(start);
  }
  for (; !open.empty(); open.pop()) {
    const auto v = as_index(open.front());
    const auto start = as_index(surface.patch[v]);
    surface.reach[start] =
        std::max(surface.reach[start], (surface.vertices[v] - surface.vertices[start]).norm());
    for (int i = surface.first[v]; i < surface.first[v + 1]; ++i) {
      const int other = surface.neighbors[as_index(i)];
      if (surface.patch[as_index(other)] >= 0) continue;
      surface.patch[as_index(other)] = surface.patch[v];
      open.push(other);
    }
  }
}

}  // namespace

RoundSurface find_round_surface(const TriangleMesh& mesh, const std::vector<MeshSample>& samples) {
  const std::vector<Around> around = look_around(mesh);
  RoundSurface surface;
  std::vector<int> number(mesh.positions.size(), -1);
  for (std::size_t v = 0; v < around.size(); ++v) {
    if (around[v].is_sharp || around[v].is_flat) continue;
    number[v] = static_cast<int>(surface.vertices.size());
    surface.vertices.push_back(mesh.positions[v]);
  }
  surface.first.push_back(0);
  for (std::size_t v = 0; v < around.size(); ++v) {
    if (number[v] < 0) continue;
    for (const int other : around[v].neighbors)
      if (number[as_index(other)] >= 0) surface.neighbors.push_back(number[as_index(other)]);
    surface.first.push_back(static_cast<int>(surface.neighbors.size()));
  }
  for (const MeshSample& sample : samples) {
    RoundSample& here = surface.at_sample.emplace_back();
    const bool is_round = std::all_of(sample.corner.begin(), sample.corner.end(),
                                      [&](int v) { return v < 0 || number[as_index(v)] >= 0; });
    if (!is_round) continue;
    here.corner = number[as_index(sample.corner[0])];
    if (sample.corner[1] < 0) here.patch = here.corner;
  }
  divide(surface);
  return surface;
}

namespace {

// Follows the way down from `start` while stays(vertex) holds for the vertices on it. Returns nothing if it
// does not hold for one of them.
template <class Stays>
std::optional<RoundPlace> way_down(const RoundSurface& surface, int start, const Pose& pose,
                                   const LevelSet& host, Stays&& stays) {
  constexpr double level = 1e-4;  // slope; it keeps rounding from deciding between corners of a level facet
  const Mat3 rotation = pose.orientation.toRotationMatrix();
  const auto place_of = [&](int v) {
    RoundPlace place{v, rotation * surface.vertices[as_index(v)] + pose.position};
    place.distance = host.distance(place.position);
    return place;
  };
  RoundPlace lowest = place_of(start);
  for (std::size_t step = 0; step < surface.vertices.size(); ++step) {
    RoundPlace best = lowest;
    const auto v = as_index(lowest.vertex);
    for (int i = surface.first[v]; i < surface.first[v + 1]; ++i) {
      const RoundPlace other = place_of(surface.neighbors[as_index(i)]);
      const double fall = lowest.distance - other.distance;
      if (other.distance < best.distance && fall > level * (other.position - lowest.position).norm())
        best = other;
    }
    if (best.vertex == lowest.vertex) break;
    if (!stays(best.vertex)) return {};
    lowest = best;
  }
  lowest.position = pose.to_world(surface.vertices[as_index(lowest.vertex)]);
  lowest.distance = host.distance(lowest.position);
  return lowest;
}

}  // namespace

RoundPlace lowest_vertex(const RoundSurface& surface, int start, const Pose& pose, const LevelSet& host) {
  return *way_down(surface, start, pose, host, [](int) { return true; });
}

std::optional<RoundPlace> lowest_in_patch(const RoundSurface& surface, int start, const Pose& pose,
                                          const LevelSet& host) {
  return way_down(surface, start, pose, host,
                  [&](int vertex) { return surface.patch[as_index(vertex)] == start; });
}

}  // namespace duet
