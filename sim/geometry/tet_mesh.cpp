#include "sim/geometry/tet_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

namespace duet {
namespace {

void add_tet(TetMesh& mesh, Tet tet) {
  const auto& x = mesh.nodes;
  const auto at = [&](int i) -> const Vec3& {
    return x[static_cast<std::size_t>(tet[static_cast<std::size_t>(i)])];
  };
  if (tet_volume(at(0), at(1), at(2), at(3)) < 0) std::swap(tet[2], tet[3]);
  mesh.tets.push_back(tet);
}

Triangle sorted(Triangle t) {
  std::sort(t.begin(), t.end());
  return t;
}

Vec3 normal_of(const TetMesh& mesh, const Triangle& t) {
  const Vec3& a = mesh.nodes[static_cast<std::size_t>(t[0])];
  const Vec3& b = mesh.nodes[static_cast<std::size_t>(t[1])];
  const Vec3& c = mesh.nodes[static_cast<std::size_t>(t[2])];
  return (b - a).cross(c - a).normalized();
}

// Texture coordinates by the rest normal's dominant axis, in metres.
Vec2f planar_uv(const Vec3& x, const Vec3& normal) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return Vec2f(static_cast<float>(x[(axis + 1) % 3]), static_cast<float>(x[(axis + 2) % 3]));
}

}  // namespace

double tet_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return (b - a).cross(c - a).dot(d - a) / 6;
}

TetMesh box_lattice(const Vec3& size, const Vec3i& cells) {
  TetMesh mesh;
  const auto node = [&](int i, int j, int k) { return (k * (cells.y() + 1) + j) * (cells.x() + 1) + i; };
  for (int k = 0; k <= cells.z(); ++k)
    for (int j = 0; j <= cells.y(); ++j)
      for (int i = 0; i <= cells.x(); ++i) {
        const Vec3 fraction(static_cast<double>(i) / cells.x(), static_cast<double>(j) / cells.y(),
                            static_cast<double>(k) / cells.z());
        mesh.nodes.emplace_back(size.cwiseProduct(fraction - Vec3::Constant(0.5)));
      }
  for (int k = 0; k < cells.z(); ++k)
    for (int j = 0; j < cells.y(); ++j)
      for (int i = 0; i < cells.x(); ++i) {
        // Corner c of the cell, numbered by its bits; odd cells are the mirror image of even ones.
        const int mirror = (i + j + k) % 2;
        const auto corner = [&](int c) {
          return node(i + ((c ^ mirror) & 1), j + ((c >> 1) & 1), k + ((c >> 2) & 1));
        };
        add_tet(mesh, {corner(0), corner(3), corner(5), corner(6)});
        add_tet(mesh, {corner(1), corner(0), corner(3), corner(5)});
        add_tet(mesh, {corner(2), corner(0), corner(3), corner(6)});
        add_tet(mesh, {corner(4), corner(0), corner(5), corner(6)});
        add_tet(mesh, {corner(7), corner(3), corner(5), corner(6)});
      }
  return mesh;
}

std::vector<Triangle> boundary(const TetMesh& mesh) {
  constexpr std::array<Triangle, 4> faces = {{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};  // outward
  std::map<Triangle, int> count;
  const auto face_of = [](const Tet& tet, const Triangle& face) {
    return Triangle{tet[static_cast<std::size_t>(face[0])], tet[static_cast<std::size_t>(face[1])],
                    tet[static_cast<std::size_t>(face[2])]};
  };
  for (const Tet& tet : mesh.tets)
    for (const Triangle& face : faces) ++count[sorted(face_of(tet, face))];
  std::vector<Triangle> triangles;
  for (const Tet& tet : mesh.tets)
    for (const Triangle& face : faces)
      if (const Triangle t = face_of(tet, face); count[sorted(t)] == 1) triangles.push_back(t);
  return triangles;
}

std::vector<BoundarySample> boundary_samples(const TetMesh& mesh, const std::vector<Triangle>& triangles,
                                             int order) {
  std::vector<BoundarySample> samples;
  const auto length = [&](int a, int b) {
    return (mesh.nodes[static_cast<std::size_t>(a)] - mesh.nodes[static_cast<std::size_t>(b)]).norm();
  };
  std::set<std::pair<int, int>> edges;
  for (const Triangle& t : triangles)
    for (std::size_t i = 0; i < 3; ++i) edges.insert(std::minmax(t[i], t[(i + 1) % 3]));
  for (const auto& [a, b] : edges)
    for (int i = 1; i < order; ++i) {
      const double w = static_cast<double>(i) / order;
      samples.push_back({{a, b, a}, {w, 1 - w, 0}, length(a, b)});
    }
  for (const Triangle& t : triangles)
    for (int i = 1; i < order; ++i)
      for (int j = 1; i + j < order; ++j) {
        const double u = static_cast<double>(i) / order, v = static_cast<double>(j) / order;
        const double spacing = std::max({length(t[0], t[1]), length(t[1], t[2]), length(t[2], t[0])});
        samples.push_back({t, {u, v, 1 - u - v}, spacing});
      }
  return samples;
}

BoundarySurface boundary_surface(const TetMesh& mesh, const std::vector<Triangle>& triangles) {
  const double crease = std::cos(40.0 * 3.14159265358979323846 / 180);
  BoundarySurface result;
  Surface& surface = result.surface;
  std::map<int, int> vertex_of_node;
  std::map<int, std::vector<std::pair<int, Vec3>>>
      groups;  // of a vertex: normal index, its first triangle's normal
  for (const Triangle& t : triangles) {
    const Vec3 normal = normal_of(mesh, t);
    std::array<Corner, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& x = mesh.nodes[static_cast<std::size_t>(t[k])];
      const auto [entry, is_new] =
          vertex_of_node.try_emplace(t[k], static_cast<int>(result.vertex_nodes.size()));
      if (is_new) {
        result.vertex_nodes.push_back(t[k]);
        surface.positions.push_back(x.cast<float>());
      }
      auto& fan = groups[entry->second];
      auto group =
          std::find_if(fan.begin(), fan.end(), [&](const auto& g) { return g.second.dot(normal) >= crease; });
      if (group == fan.end()) {
        fan.emplace_back(static_cast<int>(surface.normals.size()), normal);
        surface.normals.push_back(normal.cast<float>());
        surface.uvs.push_back(planar_uv(x, normal));
        group = std::prev(fan.end());
      }
      corners[k] = {entry->second, group->first, group->first};
    }
    surface.triangles.push_back(corners);
  }
  update_normals(surface);
  return result;
}

void update_normals(Surface& surface) {
  std::fill(surface.normals.begin(), surface.normals.end(), Vec3f::Zero());
  for (const auto& t : surface.triangles) {
    const auto at = [&](std::size_t k) -> const Vec3f& {
      return surface.positions[static_cast<std::size_t>(t[k].position)];
    };
    const Vec3f area = (at(1) - at(0)).cross(at(2) - at(0));
    for (const Corner& corner : t) surface.normals[static_cast<std::size_t>(corner.normal)] += area;
  }
  for (Vec3f& n : surface.normals) {
    const float length = n.norm();
    n = length > 0 ? Vec3f(n / length) : Vec3f(Vec3f::UnitY());
  }
}

}  // namespace duet
