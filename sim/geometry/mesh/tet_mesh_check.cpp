#include "sim/geometry/mesh/tet_mesh_check.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/base/disjoint_sets.h"
#include "sim/base/wording.h"

namespace duet {
namespace {

// Fraction of the cube of the longest edge of a tet below which it counts as having no volume.
constexpr double min_tet_volume = 1e-9;

Vec3 center(const TetMesh& mesh, const Tet& tet) {
  Vec3 sum = Vec3::Zero();
  for (const int i : tet) sum += mesh.nodes[as_index(i)];
  return sum / 4;
}

double longest_edge(const TetMesh& mesh, const Tet& tet) {
  double longest = 0;
  for (const int i : tet)
    for (const int j : tet)
      longest = std::max(longest, (mesh.nodes[as_index(i)] - mesh.nodes[as_index(j)]).norm());
  return longest;
}

// Drops nodes that no tet uses and reports their number.
void drop_unused_nodes(TetMesh& mesh, MeshReport& report) {
  const std::size_t before = mesh.nodes.size();
  keep_used_nodes(mesh);
  if (const std::size_t dropped = before - mesh.nodes.size(); dropped > 0)
    report.repairs.push_back(fmt::format("{} that no tetrahedron uses {} dropped",
                                         counted(dropped, "node", "nodes"), dropped == 1 ? "was" : "were"));
}

// Turns tets of negative volume and reports their number.
void turn_inverted(TetMesh& mesh, MeshReport& report) {
  std::size_t turned = 0;
  for (Tet& tet : mesh.tets)
    if (volume(mesh, tet) < 0) {
      std::swap(tet[2], tet[3]);
      ++turned;
    }
  if (turned > 0)
    report.repairs.push_back(fmt::format("{} of negative volume {} turned around",
                                         counted(turned, "tetrahedron", "tetrahedra"),
                                         turned == 1 ? "was" : "were"));
}

// Reports tets without volume.
void check_volumes(const TetMesh& mesh, MeshReport& report) {
  std::size_t flat = 0;
  std::string first;
  for (const Tet& tet : mesh.tets) {
    const double edge = longest_edge(mesh, tet);
    if (volume(mesh, tet) > min_tet_volume * edge * edge * edge) continue;
    if (flat++ == 0) first = place(center(mesh, tet));
  }
  if (flat > 0)
    report.flaws.push_back(
        {fmt::format("has {} without volume, {}at {}", counted(flat, "tetrahedron", "tetrahedra"),
                     flat == 1 ? "" : "the first ", first),
         "remove slivers in the program that made the mesh"});
}

// Reports faces that more than two tets share.
void check_faces(const TetMesh& mesh, MeshReport& report) {
  const std::vector<TetFace> faces = sorted_faces(mesh);
  std::size_t crowded = 0;
  std::string first;
  const auto equal = [&](std::size_t i, std::size_t k) { return faces[i].nodes == faces[k].nodes; };
  for (std::size_t i = 2; i < faces.size(); ++i) {
    const bool is_third = equal(i, i - 2) && (i == 2 || !equal(i, i - 3));  // later ones are of the same face
    if (is_third && crowded++ == 0) first = place(mesh.nodes[as_index(faces[i].nodes[0])]);
  }
  if (crowded > 0)
    report.flaws.push_back(
        {fmt::format("has {} that more than two tetrahedra share, {}at {}", counted(crowded, "face", "faces"),
                     crowded == 1 ? "" : "the first ", first),
         "remove doubled tetrahedra"});
}

}  // namespace

int connected_parts(const TetMesh& mesh) {
  DisjointSets connected(mesh.tets.size());
  int parts = static_cast<int>(mesh.tets.size());
  const std::vector<TetFace> faces = sorted_faces(mesh);
  for (std::size_t i = 1; i < faces.size(); ++i)
    if (faces[i].nodes == faces[i - 1].nodes && connected.join(faces[i - 1].tet, faces[i].tet)) --parts;
  return parts;
}

MeshReport repair(TetMesh& mesh) {
  MeshReport report;
  drop_unused_nodes(mesh, report);
  turn_inverted(mesh, report);
  check_volumes(mesh, report);
  check_faces(mesh, report);
  if (const int parts = connected_parts(mesh); parts > 1 && report.flaws.empty())
    report.flaws.push_back({fmt::format("falls into {} parts that no face connects", parts),
                            "make each of them a body of its own"});
  return report;
}

}  // namespace duet
