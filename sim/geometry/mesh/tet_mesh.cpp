#include "sim/geometry/mesh/tet_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <tuple>

#include "sim/base/assert.h"
#include "sim/base/elementary.h"
#include "sim/geometry/queries/texture.h"

namespace duet {
namespace {

// Appends a tet, turned if its volume is negative.
void add_tet(TetMesh& mesh, Tet tet) {
  if (volume(mesh, tet) < 0) std::swap(tet[2], tet[3]);
  mesh.tets.push_back(tet);
}

Triangle sorted(Triangle t) {
  std::sort(t.begin(), t.end());
  return t;
}

// Returns the face opposite to a corner of a tet, outward.
Triangle face_of(const Tet& tet, int opposite) {
  constexpr std::array<Triangle, 4> corners = {{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
  const Triangle& c = corners[static_cast<std::size_t>(opposite)];
  return {tet[static_cast<std::size_t>(c[0])], tet[static_cast<std::size_t>(c[1])],
          tet[static_cast<std::size_t>(c[2])]};
}

// Cuts a cell into five tets. node(x, y, z) returns the node at a corner of the cell with coordinates 0 or 1;
// `mirror` is 1 in odd cells, which are the mirror images of even ones.
template <class Node>
void add_five(TetMesh& mesh, int mirror, Node&& node) {
  // The bits of `c` are the coordinates of the corner.
  const auto corner = [&](int c) { return node((c ^ mirror) & 1, c >> 1 & 1, c >> 2 & 1); };
  add_tet(mesh, {corner(0), corner(3), corner(5), corner(6)});
  add_tet(mesh, {corner(1), corner(0), corner(3), corner(5)});
  add_tet(mesh, {corner(2), corner(0), corner(3), corner(6)});
  add_tet(mesh, {corner(4), corner(0), corner(5), corner(6)});
  add_tet(mesh, {corner(7), corner(3), corner(5), corner(6)});
}

// Cuts a cell into six tets: one for each order in which the axes lead from corner (0, 0, 0) to (1, 1, 1).
template <class Node>
void add_six(TetMesh& mesh, Node&& node) {
  Vec3i order(0, 1, 2);
  do {
    const Vec3i one = Vec3i::Unit(order[0]), two = one + Vec3i::Unit(order[1]);
    add_tet(mesh,
            {node(0, 0, 0), node(one.x(), one.y(), one.z()), node(two.x(), two.y(), two.z()), node(1, 1, 1)});
  } while (std::next_permutation(order.begin(), order.end()));
}

// Adds the middles of the cells, and tets around the lines between middles of adjacent cells. A face on the
// outside is joined to the middle of its cell; it is cut along the diagonal that starts at a node with an
// even sum of indices, so that the diagonals form a pattern of diamonds.
template <class Node>
void join_centers(TetMesh& mesh, const Vec3& size, const Vec3i& cells, Node&& node) {
  const int first = static_cast<int>(mesh.nodes.size());
  const auto center = [&](const Vec3i& c) { return first + (c.z() * cells.y() + c.y()) * cells.x() + c.x(); };
  const auto corner = [&](const Vec3i& c) { return node(c.x(), c.y(), c.z()); };
  std::vector<Vec3i> all;
  for (int k = 0; k < cells.z(); ++k)
    for (int j = 0; j < cells.y(); ++j)
      for (int i = 0; i < cells.x(); ++i) all.emplace_back(i, j, k);
  for (const Vec3i& c : all) {
    const Vec3 middle = c.cast<double>() + Vec3::Constant(0.5);
    mesh.nodes.emplace_back(
        size.cwiseProduct(middle.cwiseQuotient(cells.cast<double>()) - Vec3::Constant(0.5)));
  }
  for (const Vec3i& c : all)
    for (int axis = 0; axis < 3; ++axis)
      for (const int side : {0, 1}) {
        const Vec3i begin = c + side * Vec3i::Unit(axis), u = Vec3i::Unit((axis + 1) % 3),
                    v = Vec3i::Unit((axis + 2) % 3);
        const std::array<Vec3i, 4> face = {begin, begin + u, begin + u + v, begin + v};
        const bool outer = side == 0 ? c[axis] == 0 : c[axis] + 1 == cells[axis];
        if (outer) {
          const std::size_t even = static_cast<std::size_t>(begin.sum() % 2);
          add_tet(mesh, {center(c), corner(face[even]), corner(face[even + 1]), corner(face[even + 2])});
          add_tet(mesh,
                  {center(c), corner(face[even]), corner(face[even + 2]), corner(face[(even + 3) % 4])});
        } else if (side == 1) {
          for (std::size_t i = 0; i < 4; ++i)
            add_tet(mesh,
                    {center(c), center(c + Vec3i::Unit(axis)), corner(face[i]), corner(face[(i + 1) % 4])});
        }
      }
}

Vec3 normal_of(const TetMesh& mesh, const Triangle& t) {
  const Vec3& a = mesh.nodes[static_cast<std::size_t>(t[0])];
  const Vec3& b = mesh.nodes[static_cast<std::size_t>(t[1])];
  const Vec3& c = mesh.nodes[static_cast<std::size_t>(t[2])];
  return (b - a).cross(c - a).normalized();
}

}  // namespace

double tet_volume(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  return (b - a).cross(c - a).dot(d - a) / 6;
}

double volume(const TetMesh& mesh, const Tet& tet) {
  const auto x = [&](std::size_t k) -> const Vec3& { return mesh.nodes[static_cast<std::size_t>(tet[k])]; };
  return tet_volume(x(0), x(1), x(2), x(3));
}

double volume(const TetMesh& mesh) {
  double sum = 0;
  for (const Tet& tet : mesh.tets) sum += volume(mesh, tet);
  return sum;
}

TetMesh box_lattice(const Vec3& size, const Vec3i& cells, LatticePattern pattern) {
  DUET_ASSERT(size.minCoeff() > 0 && cells.minCoeff() > 0);
  TetMesh mesh;
  const auto node = [&](int i, int j, int k) { return (k * (cells.y() + 1) + j) * (cells.x() + 1) + i; };
  for (int k = 0; k <= cells.z(); ++k)
    for (int j = 0; j <= cells.y(); ++j)
      for (int i = 0; i <= cells.x(); ++i) {
        const Vec3 fraction(static_cast<double>(i) / cells.x(), static_cast<double>(j) / cells.y(),
                            static_cast<double>(k) / cells.z());
        mesh.nodes.emplace_back(size.cwiseProduct(fraction - Vec3::Constant(0.5)));
      }
  if (pattern == LatticePattern::bcc) {
    join_centers(mesh, size, cells, node);
    return mesh;
  }
  for (int k = 0; k < cells.z(); ++k)
    for (int j = 0; j < cells.y(); ++j)
      for (int i = 0; i < cells.x(); ++i)
        if (pattern == LatticePattern::five)
          add_five(mesh, (i + j + k) % 2, [&](int x, int y, int z) { return node(i + x, j + y, k + z); });
        else
          add_six(mesh, [&](int x, int y, int z) { return node(i + x, j + y, k + z); });
  return mesh;
}

void keep_used_nodes(TetMesh& mesh) {
  std::vector<int> number(mesh.nodes.size(), -1);
  for (const Tet& tet : mesh.tets)
    for (const int i : tet) number[static_cast<std::size_t>(i)] = 0;
  int count = 0;
  for (std::size_t i = 0; i < number.size(); ++i)
    if (number[i] == 0) {
      mesh.nodes[static_cast<std::size_t>(count)] = mesh.nodes[i];
      number[i] = count++;
    }
  mesh.nodes.resize(static_cast<std::size_t>(count));
  for (Tet& tet : mesh.tets)
    for (int& i : tet) i = number[static_cast<std::size_t>(i)];
}

std::vector<TetFace> sorted_faces(const TetMesh& mesh) {
  std::vector<TetFace> faces;
  faces.reserve(4 * mesh.tets.size());
  for (std::size_t t = 0; t < mesh.tets.size(); ++t)
    for (int opposite = 0; opposite < 4; ++opposite)
      faces.push_back({sorted(face_of(mesh.tets[t], opposite)), static_cast<int>(t), opposite});
  std::sort(faces.begin(), faces.end(), [](const TetFace& a, const TetFace& b) {
    return std::tie(a.nodes, a.tet, a.opposite) < std::tie(b.nodes, b.tet, b.opposite);
  });
  return faces;
}

std::vector<Triangle> boundary(const TetMesh& mesh) {
  const std::vector<TetFace> faces = sorted_faces(mesh);
  // The tet of each outer face, and 3 minus the corner opposite to the face, which sets the order of the
  // faces within a tet.
  std::vector<std::pair<int, int>> outer;
  for (std::size_t i = 0; i < faces.size();) {
    std::size_t end = i + 1;
    while (end < faces.size() && faces[end].nodes == faces[i].nodes) ++end;
    if (end == i + 1) outer.emplace_back(faces[i].tet, 3 - faces[i].opposite);
    i = end;
  }
  std::sort(outer.begin(), outer.end());
  std::vector<Triangle> triangles;
  for (const auto& [tet, face] : outer)
    triangles.push_back(face_of(mesh.tets[static_cast<std::size_t>(tet)], 3 - face));
  return triangles;
}

std::vector<BoundarySample> boundary_samples(const TetMesh& mesh, const std::vector<Triangle>& triangles,
                                             int order) {
  DUET_ASSERT(order > 0);
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

BoundarySurface boundary_surface(const TetMesh& mesh, const std::vector<Triangle>& triangles, double crease) {
  const double min_cosine = math::cos(crease * std::numbers::pi / 180);
  BoundarySurface result;
  Surface& surface = result.surface;
  std::map<int, int> vertex_of_node;
  // The normals at each vertex: index in the surface, and the normal of the first triangle that uses it.
  std::map<int, std::vector<std::pair<int, Vec3>>> groups;
  for (const Triangle& t : triangles) {
    const Vec3 normal = normal_of(mesh, t);
    std::array<Corner, 3> corners;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& x = mesh.nodes[static_cast<std::size_t>(t[k])];
      const auto [entry, is_new] =
          vertex_of_node.try_emplace(t[k], static_cast<int>(result.vertex_nodes.size()));
      if (is_new) {
        result.vertex_nodes.push_back(t[k]);
        surface.positions.push_back(x);
      }
      auto& fan = groups[entry->second];
      auto group = std::find_if(fan.begin(), fan.end(),
                                [&](const auto& g) { return g.second.dot(normal) >= min_cosine; });
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
    const auto at = [&](std::size_t k) -> const Vec3& {
      return surface.positions[static_cast<std::size_t>(t[k].position)];
    };
    const Vec3f area = (at(1) - at(0)).cross(at(2) - at(0)).cast<float>();
    for (const Corner& corner : t) surface.normals[static_cast<std::size_t>(corner.normal)] += area;
  }
  for (Vec3f& n : surface.normals) {
    const float length = n.norm();
    n = length > 0 ? Vec3f(n / length) : Vec3f(Vec3f::UnitY());
  }
}

}  // namespace duet
