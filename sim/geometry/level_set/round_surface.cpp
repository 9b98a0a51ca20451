#include "sim/geometry/level_set/round_surface.h"

#include <algorithm>
#include <map>
#include <queue>
#include <set>
#include <utility>

#include "sim/base/disjoint_sets.h"
#include "sim/base/index.h"
#include "sim/geometry/mesh/sharp_edge.h"

namespace duet {
namespace {

// 1 - cosine of the angle between faces that count as one plane: 0.08 degrees. In finer meshes all vertices
// are flat, and samples between which nothing protrudes are enough.
constexpr double same_plane_of_faces = 1e-6;
// Most corners of a facet of which each corner neighbors all others.
constexpr std::size_t most_corners = 64;

// What meets at a vertex of a mesh.
struct Around {
  bool is_flat = true;         // all edges lie between faces of one plane
  std::vector<int> neighbors;  // vertices at the other ends of its edges, and corners of its flat facets
  std::vector<int> along;      // vertices at the other ends of its sharp edges
  bool is_sharp() const { return !along.empty(); }
};

// Returns whether a vertex lies on a rim: two sharp edges meet at it, one of which goes on as the other one
// does, with a blunt turn.
bool is_on_rim(const TriangleMesh& mesh, const Around& around, const Vec3& x) {
  if (around.along.size() != 2) return false;
  const Vec3 in = x - mesh.positions[as_index(around.along[0])],
             out = mesh.positions[as_index(around.along[1])] - x;
  const double cosine = in.dot(out) / (in.norm() * out.norm());
  return cosine > sharp_edge && 1 - cosine > same_plane_of_faces;
}

// Leaves of the neighbors of each vertex those on the same round part. A rim is a part of its own: a drum
// that rolls touches with both of its rims.
void keep_neighbors_of_parts(const TriangleMesh& mesh, std::vector<Around>& around) {
  std::vector<char> on_rim(around.size());
  for (std::size_t v = 0; v < around.size(); ++v)
    on_rim[v] = is_on_rim(mesh, around[v], mesh.positions[v]) ? 1 : 0;
  for (std::size_t v = 0; v < around.size(); ++v) {
    Around& here = around[v];
    if (on_rim[v] != 0) here.neighbors = here.along;
    std::erase_if(here.neighbors, [&](int other) { return on_rim[as_index(other)] != on_rim[v]; });
  }
}

// Makes the corners of each facet neighbors of each other, also those without an edge between them. `facets`
// are sets of triangles.
void connect_corners(const TriangleMesh& mesh, const DisjointSets& facets, std::vector<Around>& around) {
  std::map<int, std::set<int>> corners;  // per facet
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    corners[facets.first(static_cast<int>(t))].insert(mesh.triangles[t].begin(), mesh.triangles[t].end());
  for (const auto& [facet, here] : corners) {
    if (here.size() < 4 || here.size() > most_corners) continue;
    for (const int v : here)
      for (const int other : here) {
        std::vector<int>& neighbors = around[as_index(v)].neighbors;
        if (other != v && std::find(neighbors.begin(), neighbors.end(), other) == neighbors.end())
          neighbors.push_back(other);
      }
  }
}

// Returns what meets at each vertex of a mesh.
std::vector<Around> look_around(const TriangleMesh& mesh) {
  struct Sides {
    Vec3 normal = Vec3::Zero();  // of the first face
    double cosine = 1;           // between the normals of the first two faces
    int faces = 0, first = -1;   // number of faces, and the first of them
  };
  DisjointSets facets(mesh.triangles.size());
  std::map<std::pair<int, int>, Sides> edges;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 normal = area_vector(mesh, t).normalized();
    const Triangle& corners = mesh.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      Sides& sides = edges[std::minmax(corners[k], corners[(k + 1) % 3])];
      const int face = static_cast<int>(t);
      if (sides.faces == 0) {
        sides.normal = normal;
        sides.first = face;
      }
      if (sides.faces == 1) {
        sides.cosine = sides.normal.dot(normal);
        if (1 - sides.cosine < same_plane_of_faces) facets.join(sides.first, face);
      }
      ++sides.faces;
    }
  }
  std::vector<Around> around(mesh.positions.size());
  for (const auto& [ends, sides] : edges)
    for (const auto& [v, other] : {ends, std::pair(ends.second, ends.first)}) {
      Around& here = around[as_index(v)];
      if (sides.faces != 2 || sides.cosine < sharp_edge) here.along.push_back(other);
      here.is_flat &= 1 - sides.cosine < same_plane_of_faces;
      here.neighbors.push_back(other);
    }
  connect_corners(mesh, facets, around);
  keep_neighbors_of_parts(mesh, around);
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
    if (around[v].is_flat || (around[v].is_sharp() && !is_on_rim(mesh, around[v], mesh.positions[v])))
      continue;
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
    std::transform(sample.corner.begin(), sample.corner.end(), here.corner.begin(),
                   [&](int v) { return v < 0 ? -1 : number[as_index(v)]; });
    if (sample.corner[1] < 0) here.patch = here.corner[0];
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
