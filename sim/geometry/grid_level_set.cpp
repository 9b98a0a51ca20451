#include "sim/geometry/grid_level_set.h"

#include <algorithm>
#include <array>

namespace duet {
namespace {

// The cell around a point: the values at its corners (bit 0: x, bit 1: y, bit 2: z) and the place within it.
struct Cell {
  std::array<double, 8> corner;
  Vec3 place;  // in [0, 1]^3

  Cell(const DenseGrid& grid, const Vec3& local) {
    const Vec3i node = local.cast<int>().cwiseMin(grid.count - Vec3i::Constant(2));  // local >= 0
    place = local - node.cast<double>();
    const std::size_t row = static_cast<std::size_t>(grid.count.x());
    const std::size_t layer = row * static_cast<std::size_t>(grid.count.y());
    const float* first = grid.values.data() + grid.index(node.x(), node.y(), node.z());
    for (std::size_t c = 0; c < 8; ++c)
      corner[c] = static_cast<double>(first[(c & 1) + (c >> 1 & 1) * row + (c >> 2) * layer]);
  }

  double value() const {
    const double x = place.x(), y = place.y(), z = place.z();
    std::array<double, 4> along_x;
    for (std::size_t i = 0; i < 4; ++i) along_x[i] = corner[2 * i] + x * (corner[2 * i + 1] - corner[2 * i]);
    const double front = along_x[0] + y * (along_x[1] - along_x[0]);
    const double back = along_x[2] + y * (along_x[3] - along_x[2]);
    return front + z * (back - front);
  }

  Vec3 gradient() const {  // per cell
    const double x = place.x(), y = place.y(), z = place.z();
    const auto slope = [&](std::size_t axis, double u, double v) {  // u, v: along the two other axes
      const std::size_t step = 1U << axis, a = 1U << (axis == 0 ? 1 : 0), b = 1U << (axis == 2 ? 1 : 2);
      const auto difference = [&](std::size_t c) { return corner[c + step] - corner[c]; };
      return (1 - v) * ((1 - u) * difference(0) + u * difference(a)) +
             v * ((1 - u) * difference(b) + u * difference(a + b));
    };
    return {slope(0, y, z), slope(1, x, z), slope(2, x, y)};
  }
};

}  // namespace

GridLevelSet::GridLevelSet(const TriangleMesh& mesh, int cells) : exact_(mesh) {
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
}

bool GridLevelSet::inside_grid(const Vec3& local) const {  // false for what is not a number
  return local.minCoeff<Eigen::PropagateNaN>() >= 0 && (last_ - local).minCoeff<Eigen::PropagateNaN>() >= 0;
}

double GridLevelSet::distance(const Vec3& x) const {
  const Vec3 local = (x - grid_.origin) * inverse_spacing_;
  if (inside_grid(local)) return Cell(grid_, local).value();
  return exact_.tree().nearest(x, std::numeric_limits<double>::infinity()).distance;
}

Vec3 GridLevelSet::normal(const Vec3& x) const {
  const Vec3 local = (x - grid_.origin) * inverse_spacing_;
  const Vec3 direction =
      inside_grid(local) ? Cell(grid_, local).gradient() : Vec3(x - exact_.tree().nearest(x).point);
  const double length = direction.norm();
  return length > 0 ? Vec3(direction / length) : Vec3(Vec3::UnitY());
}

}  // namespace duet
