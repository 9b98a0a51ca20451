#include "sim/geometry/level_set/thick_surface.h"

#include <cmath>
#include <map>
#include <numbers>

#include "sim/base/assert.h"
#include "sim/base/elementary.h"
#include "sim/base/rotation.h"
#include "sim/geometry/level_set/shape_mesh.h"

namespace duet {
namespace {

// Number of vertices of each ring of a tube.
constexpr std::size_t sides = 12;
// Detail of the ball of a particle, see shape_surface().
constexpr double bead_detail = 0.5;

int as_int(std::size_t i) { return static_cast<int>(i); }

// Returns a corner whose texture coordinate has the index of its position.
Corner corner(int position, int normal) { return {position, position, normal}; }

}  // namespace

ThickSheet::ThickSheet(const Sheet& sheet, double thickness)
    : triangles_(sheet.triangles), half_thickness_(thickness / 2) {
  DUET_ASSERT(thickness > 0);
  const int count = as_int(sheet.nodes.size());
  for (int side = 0; side < 2; ++side)
    for (const Vec3& x : sheet.nodes)
      rest_.uvs.emplace_back(static_cast<float>(x.x()), static_cast<float>(x.z()));
  int normals = 2 * count;  // one per node on each side, then those of the rim
  std::map<int, int> rim_normal;
  for (const Triangle& t : triangles_) {
    rest_.triangles.push_back({corner(t[0], t[0]), corner(t[1], t[1]), corner(t[2], t[2])});
    rest_.triangles.push_back({corner(t[0] + count, t[0] + count), corner(t[2] + count, t[2] + count),
                               corner(t[1] + count, t[1] + count)});
  }
  for (const SheetEdge& edge : edges(sheet)) {
    if (edge.other_opposite >= 0) continue;
    for (const int node : {edge.a, edge.b})
      if (rim_normal.try_emplace(node, normals).second) ++normals;
    const int na = rim_normal[edge.a], nb = rim_normal[edge.b];
    rest_.triangles.push_back({corner(edge.a + count, na), corner(edge.b + count, nb), corner(edge.b, nb)});
    rest_.triangles.push_back({corner(edge.a + count, na), corner(edge.b, nb), corner(edge.a, na)});
  }
  rest_.positions.resize(as_index(2 * count));
  rest_.normals.resize(as_index(normals));
  update(sheet.nodes, rest_);
}

void ThickSheet::update(std::span<const Vec3> x, Surface& surface) const {
  DUET_ASSERT(2 * x.size() == rest_.positions.size());
  DUET_ASSERT(surface.positions.size() == rest_.positions.size());
  // The positions of the front side first hold the sum of the area vectors around each node.
  for (std::size_t i = 0; i < x.size(); ++i) surface.positions[i].setZero();
  for (const Triangle& t : triangles_) {
    const Vec3& a = x[as_index(t[0])];
    const Vec3 area = (x[as_index(t[1])] - a).cross(x[as_index(t[2])] - a);
    for (const int i : t) surface.positions[as_index(i)] += area;
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3 sum = surface.positions[i];
    const double length = sum.norm();
    const Vec3 offset = length > 0 ? Vec3(half_thickness_ / length * sum) : Vec3(Vec3::Zero());
    surface.positions[i] = x[i] + offset;
    surface.positions[x.size() + i] = x[i] - offset;
  }
  update_normals(surface);
}

Tube::Tube(const Curve& curve, double radius) : radius_(radius), is_closed_(curve.is_closed) {
  DUET_ASSERT(curve.nodes.size() >= 2 && radius > 0);
  const std::size_t nodes = curve.nodes.size(), segments = is_closed_ ? nodes : nodes - 1;
  first_tangent_ = tangent(curve.nodes, 0);
  first_normal_ = first_tangent_.unitOrthogonal();
  const auto vertex = [&](std::size_t ring, std::size_t k) {
    return as_int((ring < nodes ? ring : 0) * sides + k % sides);
  };
  double length = 0;
  for (std::size_t ring = 0; ring < nodes; ++ring) {
    if (ring > 0) length += (curve.nodes[ring] - curve.nodes[ring - 1]).norm();
    for (std::size_t k = 0; k < sides; ++k)
      rest_.uvs.emplace_back(
          static_cast<float>(2 * std::numbers::pi * radius * static_cast<double>(k) / sides),
          static_cast<float>(length));
  }
  for (std::size_t ring = 0; ring < segments; ++ring)
    for (std::size_t k = 0; k < sides; ++k) {
      const int a = vertex(ring, k), b = vertex(ring, k + 1), c = vertex(ring + 1, k + 1),
                d = vertex(ring + 1, k);
      rest_.triangles.push_back({corner(a, a), corner(b, b), corner(c, c)});
      rest_.triangles.push_back({corner(a, a), corner(c, c), corner(d, d)});
    }
  std::size_t normals = nodes * sides;
  if (!is_closed_) {
    const int first = as_int(normals++), last = as_int(normals++);
    for (std::size_t k = 2; k < sides; ++k) {
      const auto end = [&](std::size_t ring, std::size_t i, int normal) {
        return corner(vertex(ring, i), normal);
      };
      rest_.triangles.push_back({end(0, 0, first), end(0, k, first), end(0, k - 1, first)});
      rest_.triangles.push_back({end(segments, 0, last), end(segments, k - 1, last), end(segments, k, last)});
    }
  }
  rest_.positions.resize(nodes * sides);
  rest_.normals.resize(normals);
  update(curve.nodes, rest_);
}

std::size_t Tube::node(std::size_t position) const { return position / sides; }

Vec3 Tube::tangent(std::span<const Vec3> x, std::size_t node) const {
  const std::size_t last = x.size() - 1;
  const std::size_t before = node > 0 ? node - 1 : (is_closed_ ? last : 0);
  const std::size_t after = node < last ? node + 1 : (is_closed_ ? 0 : last);
  const Vec3 along = x[after] - x[before];
  const double length = along.norm();
  return length > 0 ? Vec3(along / length) : Vec3(Vec3::UnitY());
}

// The rings are carried along the curve without twist. The twist that a closed curve needs to close is spread
// over all of it.
void Tube::update(std::span<const Vec3> x, Surface& surface) const {
  DUET_ASSERT(x.size() * sides == rest_.positions.size());
  DUET_ASSERT(surface.positions.size() == rest_.positions.size());
  Vec3 along = tangent(x, 0);
  const Vec3 start = shortest_rotation(first_tangent_, along) * first_normal_;
  double mismatch = 0;
  if (is_closed_) {
    Vec3 normal = start, previous = along;
    for (std::size_t ring = 1; ring <= x.size(); ++ring) {
      const Vec3 next = tangent(x, ring % x.size());
      normal = shortest_rotation(previous, next) * normal;
      previous = next;
    }
    mismatch = math::atan2(start.cross(normal).dot(along), start.dot(normal));
  }
  Vec3 normal = start;
  for (std::size_t ring = 0; ring < x.size(); ++ring) {
    const Vec3 next = tangent(x, ring);
    normal = shortest_rotation(along, next) * normal;
    along = next;
    const double twist = mismatch * static_cast<double>(ring) / static_cast<double>(x.size());
    for (std::size_t k = 0; k < sides; ++k) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(k) / sides - twist;
      const Vec3 out = math::cos(angle) * normal + math::sin(angle) * along.cross(normal);
      surface.positions[ring * sides + k] = x[ring] + radius_ * out;
    }
  }
  update_normals(surface);
}

Bead::Bead(double radius) : rest_(shape_surface(LevelSet::sphere(radius), bead_detail)) {}

void Bead::update(std::span<const Vec3> x, Surface& surface) const {
  DUET_ASSERT(!x.empty());
  DUET_ASSERT(surface.positions.size() == rest_.positions.size());
  for (std::size_t k = 0; k < surface.positions.size(); ++k)
    surface.positions[k] = x.front() + rest_.positions[k];
}

}  // namespace duet
