#include "sim/geometry/level_set/grid_level_set.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "sim/base/assert.h"
#include "sim/base/parallel.h"
#include "sim/geometry/mesh/sharp_edge.h"

namespace duet {
namespace {

// The cell around a point: the values at its corners (bit 0 of the index: x, bit 1: y, bit 2: z) and the
// place within it.
struct Cell {
  std::array<double, 8> corner;
  Vec3 place;  // coordinates within the cell, in [0, 1]

  Cell(const DenseGrid& grid, const Vec3& local) {
    const Vec3i node = local.cast<int>().cwiseMin(grid.count - Vec3i::Constant(2));  // local >= 0
    place = local - node.cast<double>();
    const std::size_t row = static_cast<std::size_t>(grid.count.x());
    const std::size_t layer = row * static_cast<std::size_t>(grid.count.y());
    const float* first = grid.values.data() + grid.index(node.x(), node.y(), node.z());
    for (std::size_t c = 0; c < 8; ++c)
      corner[c] = static_cast<double>(first[(c & 1) + (c >> 1 & 1) * row + (c >> 2) * layer]);
  }

  // Returns the trilinear interpolant.
  double value() const {
    const double x = place.x(), y = place.y(), z = place.z();
    std::array<double, 4> along_x;
    for (std::size_t i = 0; i < 4; ++i) along_x[i] = corner[2 * i] + x * (corner[2 * i + 1] - corner[2 * i]);
    const double front = along_x[0] + y * (along_x[1] - along_x[0]);
    const double back = along_x[2] + y * (along_x[3] - along_x[2]);
    return front + z * (back - front);
  }

  // Returns the gradient of the interpolant, per cell.
  Vec3 gradient() const {
    const double x = place.x(), y = place.y(), z = place.z();
    const auto slope = [&](std::size_t axis, double u, double v) {  // u, v: places along the two other axes
      const std::size_t step = 1U << axis, a = 1U << (axis == 0 ? 1 : 0), b = 1U << (axis == 2 ? 1 : 2);
      const auto difference = [&](std::size_t c) { return corner[c + step] - corner[c]; };
      return (1 - v) * ((1 - u) * difference(0) + u * difference(a)) +
             v * ((1 - u) * difference(b) + u * difference(a + b));
    };
    return {slope(0, y, z), slope(1, x, z), slope(2, x, y)};
  }
};

}  // namespace

GridLevelSet::GridLevelSet(const TriangleMesh& mesh, int cells, SharpEdges sharp_edges) : exact_(mesh) {
  DUET_ASSERT(cells > 0);
  for (const Vec3& x : mesh.positions) {
    bounds_.extend(x);
    bounding_radius_ = std::max(bounding_radius_, x.norm());
  }
  const int margin = std::max(4, cells / 8);
  grid_ = signed_distances(mesh, exact_.tree(), bounds_.sizes().maxCoeff() / cells, margin);
  inverse_spacing_ = 1 / grid_.spacing;
  last_ = (grid_.count - Vec3i::Ones()).cast<double>();
  const float deepest = *std::min_element(grid_.values.begin(), grid_.values.end());
  thickness_ = std::max(-2.0 * static_cast<double>(deepest), grid_.spacing);
  find_thin_walls(mesh);
  if (sharp_edges == SharpEdges::exact) find_creases(mesh);
}

namespace {

// Upper bound of the distance to the surface, in cells, in the cells near a thin wall or a sharp edge. It
// only speeds up their searches.
constexpr double reach_of_exact = 6;
// Thickness in cells below which a wall is thin. Thicker walls have a node in their middle wherever they lie.
// A larger value makes more cells exact and slower.
constexpr double thin = 1.5;
// Greatest cosine between the normals of the two sides of a wall, so that they face away from each other by
// about 162 degrees or more. Wedges do not count as walls, because they are arbitrarily thin at their edge.
constexpr double faces_away = -0.95;

// Returns the thickness (m) of the wall under a place `x` of the surface with the normal `n`; infinity if
// there is none. It looks at three depths up to half of the thickness of a thin wall.
double wall_thickness(const MeshDistance& exact, const Vec3& x, const Vec3& n, double spacing) {
  for (const double depth : {0.05 * thin, 0.15 * thin, 0.5 * thin}) {
    // The depth in m.
    const double way = depth * spacing;
    const SignedDistance below = exact.at(x - way * n, way * (1 + 1e-9));
    if (below.normal.dot(n) < faces_away) return way - below.distance;
  }
  return std::numeric_limits<double>::infinity();
}

// Least ratio of the longest edge of a needle to its height, and the least length of this edge in half cells.
// Other triangles have at most a few times as many places as their area needs. A smaller ratio would change
// the places of triangles that are common.
constexpr double needle_ratio = 8;
constexpr int needle_length = 9;

// Calls visit(x) at places of the triangle that are at most `spacing` (m) apart along its edges. `area` is
// twice its area (m^2).
template <class Visit>
void for_each_place(const std::array<Vec3, 3>& corners, double area, double spacing, Visit&& visit) {
  const auto length = [&](std::size_t k) { return (corners[(k + 1) % 3] - corners[k]).norm(); };
  const double longest = std::max({length(0), length(1), length(2)});
  const int parts = std::max(1, static_cast<int>(std::ceil(longest / spacing)));
  const Vec3 &a = corners[0], &b = corners[1], &c = corners[2];
  if (parts < needle_length || !(area * needle_ratio < longest * longest)) {
    for (int i = 0; i < parts; ++i)
      for (int j = 0; i + j < parts; ++j)
        visit(a + (i + 1 / 3.0) / parts * (b - a) + (j + 1 / 3.0) / parts * (c - a));
    return;
  }
  // Parts of equal edges would lie far closer across a needle than along it, and the fan of a disc of a
  // thousand corners would have millions. Stations along the longest edge have places across the needle
  // there.
  const std::size_t k = longest == length(0) ? 0 : longest == length(1) ? 1 : 2;
  const Vec3 &start = corners[k], along = corners[(k + 1) % 3] - start,
             to_apex = corners[(k + 2) % 3] - start;
  const double foot = std::clamp(to_apex.dot(along) / (longest * longest), 0.0, 1.0);
  const Vec3 height = to_apex - foot * along;
  for (int i = 0; i < parts; ++i) {
    const double station = (i + 0.5) / parts;
    const Vec3 across = (station < foot ? station / foot : (1 - station) / (1 - foot)) * height;
    const int rows = std::max(1, static_cast<int>(std::ceil(across.norm() / spacing)));
    for (int j = 0; j < rows; ++j) visit(start + station * along + (j + 0.5) / rows * across);
  }
}

}  // namespace

// Every triangle is tested at places half a cell apart.
void GridLevelSet::find_thin_walls(const TriangleMesh& mesh) {
  const double h = grid_.spacing;
  std::vector<std::vector<Vec3>> places(mesh.triangles.size());
  std::vector<double> thinnest(mesh.triangles.size(), std::numeric_limits<double>::infinity());
  parallel_for(mesh.triangles.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) {
      const Vec3 area = area_vector(mesh, t);
      if (!(area.squaredNorm() > 0)) continue;
      const Vec3 n = area.normalized();
      for_each_place({mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)}, 2 * area.norm(), h / 2,
                     [&](const Vec3& x) {
                       const double thickness = wall_thickness(exact_, x, n, h);
                       if (!(thickness < thin * h)) return;
                       places[t].push_back(x);
                       thinnest[t] = std::min(thinnest[t], thickness);
                     });
    }
  });
  const double least = *std::min_element(thinnest.begin(), thinnest.end());
  if (!std::isfinite(least)) return;
  thickness_ = std::min(thickness_, std::max(least, 1e-6 * h));
  for (const std::vector<Vec3>& of_triangle : places)
    for (const Vec3& x : of_triangle) mark_around(x);
}

// Cells are marked at places of every sharp edge half a cell apart. The gradient of the distance jumps there,
// and interpolation would round it.
void GridLevelSet::find_creases(const TriangleMesh& mesh) {
  // The normal of the first face at each edge.
  std::map<std::pair<int, int>, Vec3> edges;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 area = area_vector(mesh, t);
    if (!(area.squaredNorm() > 0)) continue;
    const Vec3 normal = area.normalized();
    for (std::size_t k = 0; k < 3; ++k) {
      const std::pair<int, int> edge = std::minmax(mesh.triangles[t][k], mesh.triangles[t][(k + 1) % 3]);
      const auto [found, is_first] = edges.try_emplace(edge, normal);
      if (is_first || found->second.dot(normal) >= sharp_edge) continue;
      const Vec3 &a = mesh.positions[as_index(edge.first)], &b = mesh.positions[as_index(edge.second)];
      const int parts = std::max(1, static_cast<int>(std::ceil(2 * (b - a).norm() * inverse_spacing_)));
      for (int i = 0; i <= parts; ++i) mark_around(a + static_cast<double>(i) / parts * (b - a));
    }
  }
}

// Marks all cells within a cell and a half of `x`.
void GridLevelSet::mark_around(const Vec3& x) {
  if (is_exact_.empty()) is_exact_.assign(grid_.values.size(), 0);
  const Vec3 local = (x - grid_.origin) * inverse_spacing_;
  const Vec3i first = (local.array() - 1.5).floor().cast<int>().max(0),
              last = (local.array() + 1.5).floor().cast<int>().min(grid_.count.array() - 2);
  for (int k = first.z(); k <= last.z(); ++k)
    for (int j = first.y(); j <= last.y(); ++j)
      for (int i = first.x(); i <= last.x(); ++i) is_exact_[grid_.index(i, j, k)] = 1;
}

bool GridLevelSet::is_exact_at(const Vec3& local) const {
  if (is_exact_.empty()) return false;
  const Vec3i node = local.cast<int>().cwiseMin(grid_.count - Vec3i::Constant(2));
  return is_exact_[grid_.index(node.x(), node.y(), node.z())] != 0;
}

// Returns false for coordinates that are not a number.
bool GridLevelSet::inside_grid(const Vec3& local) const {
  return local.minCoeff<Eigen::PropagateNaN>() >= 0 && (last_ - local).minCoeff<Eigen::PropagateNaN>() >= 0;
}

bool GridLevelSet::is_exact(const Vec3& x) const {
  const Vec3 local = (x - grid_.origin) * inverse_spacing_;
  return inside_grid(local) && is_exact_at(local);
}

double GridLevelSet::distance(const Vec3& x) const {
  const Vec3 local = (x - grid_.origin) * inverse_spacing_;
  if (inside_grid(local))
    return is_exact_at(local) ? exact_.distance(x, reach_of_exact * grid_.spacing)
                              : Cell(grid_, local).value();
  return exact_.tree().nearest(x, std::numeric_limits<double>::infinity()).distance;
}

Vec3 GridLevelSet::normal(const Vec3& x) const {
  const Vec3 local = (x - grid_.origin) * inverse_spacing_;
  if (inside_grid(local) && is_exact_at(local)) return exact_.at(x, reach_of_exact * grid_.spacing).normal;
  const Vec3 direction =
      inside_grid(local) ? Cell(grid_, local).gradient() : Vec3(x - exact_.tree().nearest(x).point);
  const double length = direction.norm();
  return length > 0 ? Vec3(direction / length) : Vec3(Vec3::UnitY());
}

}  // namespace duet
