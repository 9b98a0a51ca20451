#include "sim/geometry/queries/triangle_pack.h"

#include "sim/base/assert.h"
#include "sim/base/dot_in_order.h"
#include "sim/geometry/queries/closest_points.h"

namespace duet {
namespace {

vector8 operator-(const vector8& a, const vector8& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
// Sums in the order of dot_in_order().
double8 dot(const vector8& a, const vector8& b) { return (a.x * b.x + a.y * b.y) + a.z * b.z; }

}  // namespace

void TrianglePack::set(std::size_t lane, const Vec3& a, const Vec3& b, const Vec3& c) {
  DUET_ASSERT(lane < pack_width && (degenerate_ >> lane & 1u) == 0);
  const std::array<const Vec3*, 3> corners = {&a, &b, &c};
  for (std::size_t k = 0; k < 3; ++k) {
    corner_[k].x[lane] = corners[k]->x();
    corner_[k].y[lane] = corners[k]->y();
    corner_[k].z[lane] = corners[k]->z();
  }
  if (is_degenerate(a, b, c)) degenerate_ |= 1u << lane;
}

Vec3 TrianglePack::corner(std::size_t k, std::size_t lane) const {
  return {corner_[k].x[lane], corner_[k].y[lane], corner_[k].z[lane]};
}

// Computes nearest_weights() with selections instead of early returns. The first of its returns is selected
// last, so that it takes precedence.
double8 TrianglePack::squared_distances(const Vec3& x) const {
  const vector8 &a = corner_[0], &b = corner_[1], &c = corner_[2];
  const vector8 at = {double8{} + x.x(), double8{} + x.y(), double8{} + x.z()};
  const vector8 ab = b - a, ac = c - a, ax = at - a, bx = at - b, cx = at - c;
  const double8 d1 = dot(ab, ax), d2 = dot(ac, ax), d3 = dot(ab, bx), d4 = dot(ac, bx), d5 = dot(ab, cx),
                d6 = dot(ac, cx);
  const double8 on_c = d1 * d4 - d3 * d2, on_b = d5 * d2 - d1 * d6, on_a = d3 * d6 - d5 * d4;
  const double8 sum = on_a + on_b + on_c, none{}, all = none + 1.0;
  vector8 w = {1.0 - on_b / sum - on_c / sum, on_b / sum, on_c / sum};
  const auto take = [&w](const mask8& where, const double8& on_first, const double8& on_second,
                         const double8& on_third) {
    w = {select(where, on_first, w.x), select(where, on_second, w.y), select(where, on_third, w.z)};
  };
  const double8 along_bc = (d4 - d3) / ((d4 - d3) + (d5 - d6)), along_ac = d2 / (d2 - d6),
                along_ab = d1 / (d1 - d3);
  take((on_a <= 0) & (d4 >= d3) & (d5 >= d6), none, 1.0 - along_bc, along_bc);
  take((on_b <= 0) & (d2 >= 0) & (d6 <= 0), 1.0 - along_ac, none, along_ac);
  take((on_c <= 0) & (d1 >= 0) & (d3 <= 0), 1.0 - along_ab, along_ab, none);
  take((d6 >= 0) & (d5 <= d6), none, none, all);
  take((d3 >= 0) & (d4 <= d3), none, all, none);
  take((d1 <= 0) & (d2 <= 0), all, none, none);
  const vector8 nearest = {w.x * a.x + w.y * b.x + w.z * c.x, w.x * a.y + w.y * b.y + w.z * c.y,
                           w.x * a.z + w.y * b.z + w.z * c.z};
  const vector8 way = nearest - at;
  double8 squared = dot(way, way);
  for (unsigned lanes = degenerate_; lanes != 0; lanes &= lanes - 1) {
    const auto lane = static_cast<std::size_t>(__builtin_ctz(lanes));
    const Vec3 p = corner(0, lane), q = corner(1, lane), r = corner(2, lane),
               weight = nearest_weights(p, q, r, x);
    squared[lane] = square_in_order(weight[0] * p + weight[1] * q + weight[2] * r - x);
  }
  return squared;
}

}  // namespace duet
