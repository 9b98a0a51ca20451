#include "sim/geometry/queries/closest_points.h"

#include <algorithm>
#include <limits>

#include "sim/base/dot_in_order.h"

namespace duet {
namespace {

// Squared sine below which a triangle counts as an edge and two edges as parallel. Rounding of the products
// from which it is computed could turn the sign of smaller values.
constexpr double flat = 1e-14;

}  // namespace

Vec2 nearest_weights(const Vec3& a, const Vec3& b, const Vec3& x) {
  const Vec3 ab = b - a;
  const double length = square_in_order(ab);
  const double t = length > 0 ? std::clamp(dot_in_order(ab, x - a) / length, 0.0, 1.0) : 0;
  return {1 - t, t};
}

bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a;
  const double product = square_in_order(ab) * square_in_order(ac), cosine = dot_in_order(ab, ac);
  return product - cosine * cosine <= flat * product;
}

// The nearest feature follows from the signs of the projections on the edges: first the Voronoi regions of
// the corners are tested, then those of the edges; the rest is that of the face.
Vec3 nearest_weights(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x) {
  const Vec3 ab = b - a, ac = c - a;
  if (is_degenerate(a, b, c)) {
    const Vec2 on_ab = nearest_weights(a, b, x), on_bc = nearest_weights(b, c, x),
               on_ca = nearest_weights(c, a, x);
    const std::array<Vec3, 3> candidates = {Vec3(on_ab[0], on_ab[1], 0), Vec3(0, on_bc[0], on_bc[1]),
                                            Vec3(on_ca[1], 0, on_ca[0])};
    const auto distance = [&](const Vec3& w) { return square_in_order(w[0] * a + w[1] * b + w[2] * c - x); };
    return *std::min_element(candidates.begin(), candidates.end(),
                             [&](const Vec3& v, const Vec3& w) { return distance(v) < distance(w); });
  }
  const double d1 = dot_in_order(ab, x - a), d2 = dot_in_order(ac, x - a);
  if (d1 <= 0 && d2 <= 0) return Vec3::UnitX();
  const double d3 = dot_in_order(ab, x - b), d4 = dot_in_order(ac, x - b);
  if (d3 >= 0 && d4 <= d3) return Vec3::UnitY();
  const double d5 = dot_in_order(ab, x - c), d6 = dot_in_order(ac, x - c);
  if (d6 >= 0 && d5 <= d6) return Vec3::UnitZ();
  const double on_c = d1 * d4 - d3 * d2;  // barycentric weights times the squared doubled area
  if (on_c <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = d1 / (d1 - d3);
    return {1 - t, t, 0};
  }
  const double on_b = d5 * d2 - d1 * d6;
  if (on_b <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = d2 / (d2 - d6);
    return {1 - t, 0, t};
  }
  const double on_a = d3 * d6 - d5 * d4;
  if (on_a <= 0 && d4 >= d3 && d5 >= d6) {
    const double t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return {0, 1 - t, t};
  }
  const double sum = on_a + on_b + on_c;
  return {1 - on_b / sum - on_c / sum, on_b / sum, on_c / sum};
}

ClosestPoints closest_point_triangle(const FourPoints& x) {
  const Vec3 w = nearest_weights(x[1], x[2], x[3], x[0]);
  ClosestPoints result;
  result.weight = {1, -w[0], -w[1], -w[2]};
  result.difference = w[0] * (x[0] - x[1]) + w[1] * (x[0] - x[2]) + w[2] * (x[0] - x[3]);
  return result;
}

ClosestPoints closest_edge_edge(const FourPoints& x) {
  const Vec3 d = x[1] - x[0], e = x[3] - x[2], r = x[0] - x[2];
  const auto at = [&](double s, double t) { return ClosestPoints{{1 - s, s, t - 1, -t}, r + s * d - t * e}; };
  const double dd = d.squaredNorm(), ee = e.squaredNorm(), de = d.dot(e);
  const double denominator = dd * ee - de * de;
  if (denominator > flat * dd * ee) {
    const double dr = d.dot(r), er = e.dot(r);
    const double s = (de * er - dr * ee) / denominator, t = (dd * er - de * dr) / denominator;
    if (s >= 0 && s <= 1 && t >= 0 && t <= 1) return at(s, t);
  }
  // If the closest points of the lines are not both on the edges, or the edges are parallel, an end of one
  // edge is as near as any point.
  const std::array<ClosestPoints, 4> ends = {
      at(0, nearest_weights(x[2], x[3], x[0])[1]), at(1, nearest_weights(x[2], x[3], x[1])[1]),
      at(nearest_weights(x[0], x[1], x[2])[1], 0), at(nearest_weights(x[0], x[1], x[3])[1], 1)};
  return *std::min_element(ends.begin(), ends.end(), [](const ClosestPoints& a, const ClosestPoints& b) {
    return a.difference.squaredNorm() < b.difference.squaredNorm();
  });
}

}  // namespace duet
