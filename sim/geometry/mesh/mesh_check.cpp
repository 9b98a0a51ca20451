#include "sim/geometry/mesh/mesh_check.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numeric>
#include <set>

#include <fmt/format.h>

#include "sim/base/disjoint_sets.h"
#include "sim/base/wording.h"

namespace duet {
namespace {

// Vertices within this fraction of the diagonal of the mesh are joined: they differ by the rounding of floats
// or printed digits. A larger value would join small details.
constexpr double joined_distance = 1e-6;
// Fraction of the cube of the diagonal below which a mesh counts as enclosing no volume.
constexpr double min_enclosed_volume = 1e-9;

// Largest magnitude of a coordinate. Pictures and exports hold floats; and doubles hold the squares and cubes
// of such lengths.
constexpr double max_coordinate = std::numeric_limits<float>::max();

Eigen::AlignedBox3d box_of(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& x : mesh.positions) box.extend(x);
  return box;
}

double diagonal(const TriangleMesh& mesh) { return box_of(mesh).diagonal().norm(); }

// Renumbers the vertices so that each set becomes one, at the position of its least member.
void merge(TriangleMesh& mesh, DisjointSets& sets) {
  std::vector<int> renumbered(mesh.positions.size(), -1);
  std::vector<Vec3> positions;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    if (const int first = sets.first(static_cast<int>(v)); first == static_cast<int>(v)) {
      renumbered[v] = static_cast<int>(positions.size());
      positions.push_back(mesh.positions[v]);
    } else {
      renumbered[v] = renumbered[as_index(first)];
    }
  mesh.positions = std::move(positions);
  for (Triangle& t : mesh.triangles)
    for (int& v : t) v = renumbered[as_index(v)];
}

// Joins vertices at exactly the same place. File formats repeat them at seams, so this is not reported.
void merge_equal(TriangleMesh& mesh) {
  const auto key = [&](int v) {
    const Vec3& x = mesh.positions[as_index(v)];
    return std::array{x.x(), x.y(), x.z()};
  };
  std::vector<int> order(mesh.positions.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::pair(key(a), a) < std::pair(key(b), b); });
  DisjointSets sets(order.size());
  for (std::size_t i = 1; i < order.size(); ++i)
    if (key(order[i - 1]) == key(order[i])) sets.join(order[i - 1], order[i]);
  merge(mesh, sets);
}

// Joins vertices that differ by rounding and returns how many vanished.
std::size_t merge_near(TriangleMesh& mesh) {
  const double distance = joined_distance * diagonal(mesh);
  if (distance == 0) return 0;
  // Places count from the corner of the mesh, so that numbers of cells stay below a million, however far from
  // the origin the mesh is.
  const Vec3 corner = box_of(mesh).min();
  const auto cell = [&](double x) { return static_cast<std::int64_t>(std::floor(x / (4 * distance))); };
  std::map<std::array<std::int64_t, 3>, std::vector<int>> cells;
  DisjointSets sets(mesh.positions.size());
  std::size_t joined = 0;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Vec3 &position = mesh.positions[v], x = position - corner;
    const Vec3 low = x.array() - distance, high = x.array() + distance;
    for (std::int64_t i = cell(low.x()); i <= cell(high.x()); ++i)
      for (std::int64_t j = cell(low.y()); j <= cell(high.y()); ++j)
        for (std::int64_t k = cell(low.z()); k <= cell(high.z()); ++k)
          if (const auto found = cells.find({i, j, k}); found != cells.end())
            for (const int other : found->second)
              if ((mesh.positions[as_index(other)] - position).norm() <= distance)
                joined += sets.join(other, static_cast<int>(v)) ? 1 : 0;
    cells[{cell(x.x()), cell(x.y()), cell(x.z())}].push_back(static_cast<int>(v));
  }
  if (joined > 0) merge(mesh, sets);
  return joined;
}

// Drops triangles with two corners in one vertex and returns their number. They have no area, and the mesh
// closes without them.
std::size_t drop_collapsed(TriangleMesh& mesh) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Triangle& v = mesh.triangles[t];
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
    mesh.triangles[kept] = mesh.triangles[t];
    if (!mesh.normals.empty()) mesh.normals[kept] = mesh.normals[t];
    if (!mesh.uvs.empty()) mesh.uvs[kept] = mesh.uvs[t];
    ++kept;
  }
  const std::size_t dropped = mesh.triangles.size() - kept;
  mesh.triangles.resize(kept);
  if (!mesh.normals.empty()) mesh.normals.resize(kept);
  if (!mesh.uvs.empty()) mesh.uvs.resize(kept);
  return dropped;
}

void drop_unused_vertices(TriangleMesh& mesh) {
  std::vector<int> renumbered(mesh.positions.size(), -1);
  for (const Triangle& t : mesh.triangles)
    for (const int v : t) renumbered[as_index(v)] = 0;
  int count = 0;
  for (std::size_t v = 0; v < renumbered.size(); ++v)
    if (renumbered[v] == 0) {
      mesh.positions[as_index(count)] = mesh.positions[v];
      renumbered[v] = count++;
    }
  mesh.positions.resize(as_index(count));
  for (Triangle& t : mesh.triangles)
    for (int& v : t) v = renumbered[as_index(v)];
}

void turn_around(TriangleMesh& mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  for (auto& uvs : mesh.uvs) std::swap(uvs[1], uvs[2]);
  mesh.normals.clear();  // it is not known which way those of the file point; new ones are computed
}

// Counts edges with one kind of fault and remembers the place of the first one.
struct EdgeFault {
  std::size_t count = 0;
  std::string first;
  void add(const TriangleMesh& mesh, const std::pair<int, int>& edge) {
    if (count++ == 0)
      first = fmt::format("from {} to {}", place(mesh.positions[as_index(edge.first)]),
                          place(mesh.positions[as_index(edge.second)]));
  }
  void report(std::vector<MeshFlaw>& flaws, std::string_view singular, std::string_view plural,
              const std::string& remedy) const {
    if (count > 0)
      flaws.push_back({fmt::format("has {}, {}{}", counted(count, singular, plural),
                                   count == 1 ? "" : "the first ", first),
                       remedy});
  }
};

// Reports open edges, edges of more than two triangles, and edges between triangles that face opposite ways.
void check_edges(const TriangleMesh& mesh, std::vector<MeshFlaw>& flaws) {
  struct Uses {
    // Number of triangles that run through the edge from its lesser vertex, and of those that run to it.
    int forward = 0, backward = 0;
  };
  std::map<std::pair<int, int>, Uses> edges;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const int a = t[k], b = t[(k + 1) % 3];
      ++(a < b ? edges[{a, b}].forward : edges[{b, a}].backward);
    }
  EdgeFault open, crowded, inconsistent;
  for (const auto& [edge, uses] : edges) {
    const int all = uses.forward + uses.backward;
    if (all == 1)
      open.add(mesh, edge);
    else if (all > 2)
      crowded.add(mesh, edge);
    else if (uses.forward != 1)
      inconsistent.add(mesh, edge);
  }
  open.report(flaws, "open edge", "open edges",
              "fill the holes in a modelling program: only a closed surface has an inside");
  crowded.report(flaws, "non-manifold edge, shared by more than two triangles",
                 "non-manifold edges, shared by more than two triangles",
                 "remove inner walls and doubled triangles, or split the mesh into bodies");
  inconsistent.report(flaws, "edge between triangles that face opposite ways",
                      "edges between triangles that face opposite ways",
                      "recalculate the normals to the outside in a modelling program");
}

// Reports a mesh that falls into several parts.
void check_parts(const TriangleMesh& mesh, std::vector<MeshFlaw>& flaws) {
  DisjointSets sets(mesh.positions.size());
  for (const Triangle& t : mesh.triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[1], t[2]);
  }
  std::vector<int> parts;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    if (sets.first(static_cast<int>(v)) == static_cast<int>(v)) parts.push_back(static_cast<int>(v));
  if (parts.size() > 1)
    flaws.push_back({fmt::format("falls into {} parts that are not connected, the second one at {}",
                                 parts.size(), place(mesh.positions[as_index(parts[1])])),
                     "unite them in a modelling program, or make each a body of its own"});
}

// Returns whether all coordinates are finite and at most max_coordinate, and reports those that are not.
// Vertices with the same bits count once, because files are read with a copy of a vertex for each corner.
bool is_finite(const TriangleMesh& mesh, std::vector<MeshFlaw>& flaws) {
  const auto bad = [](const Vec3& x) { return !(x.cwiseAbs().array() <= max_coordinate).all(); };
  std::set<std::array<std::uint64_t, 3>>
      found;  // bits of coordinates: not-a-numbers are not even equal to themselves
  for (const Vec3& x : mesh.positions)
    if (bad(x)) found.insert(std::bit_cast<std::array<std::uint64_t, 3>>(std::array{x.x(), x.y(), x.z()}));
  if (!found.empty())
    flaws.push_back({fmt::format("has {} with coordinates that are no finite numbers, or above 3.4e38",
                                 counted(found.size(), "vertex", "vertices")),
                     "export the mesh again"});
  return found.empty();
}

// Reports a mesh without volume and turns one that faces inward.
void check_volume(TriangleMesh& mesh, MeshReport& report) {
  const double size = diagonal(mesh), volume = mass_properties(mesh).volume;
  if (!(std::abs(volume) > min_enclosed_volume * size * size * size)) {
    report.flaws.push_back({fmt::format("encloses no volume ({:.3g} m^3 before scaling, {:.3g} m across)",
                                        std::abs(volume), size),
                            "a body needs a surface with an inside: give a flat one some thickness"});
  } else if (volume < 0) {
    turn_around(mesh);
    report.repairs.push_back(
        fmt::format("all {} triangles faced inward and were turned around", mesh.triangles.size()));
  }
}

}  // namespace

MeshReport repair(TriangleMesh& mesh) {
  MeshReport report;
  if (!is_finite(mesh, report.flaws)) return report;
  merge_equal(mesh);
  if (const std::size_t joined = merge_near(mesh); joined > 0)
    report.repairs.push_back(fmt::format("{} within {:.2g} m of another one {} joined to it",
                                         counted(joined, "vertex", "vertices"),
                                         joined_distance * diagonal(mesh), joined == 1 ? "was" : "were"));
  if (const std::size_t dropped = drop_collapsed(mesh); dropped > 0)
    report.repairs.push_back(fmt::format("{} without area {} dropped",
                                         counted(dropped, "triangle", "triangles"),
                                         dropped == 1 ? "was" : "were"));
  drop_unused_vertices(mesh);
  if (mesh.triangles.empty()) {
    report.flaws.push_back({"has no triangle", "export the surface as triangles or polygons"});
    return report;
  }
  check_edges(mesh, report.flaws);
  check_parts(mesh, report.flaws);
  if (report.flaws.empty()) check_volume(mesh, report);
  return report;
}

}  // namespace duet
