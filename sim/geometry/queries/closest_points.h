// Closest points of a point and a triangle and of two edges, as weights of their corners.
#pragma once

#include <array>

#include "sim/base/types.h"

namespace duet {

/// The corners of a pair of elements (m): a point and the three corners of a triangle, or the ends of one
/// edge and of another.
using FourPoints = std::array<Vec3, 4>;

/// The closest points of a pair of elements. The weighted sum of any values at the corners (positions,
/// velocities) is their difference between the two closest points, first element minus second.
struct ClosestPoints {
  /// Weights of the corners: those of the first element add up to 1, those of the second to -1.
  std::array<double, 4> weight{};
  /// Vector from the closest point of the second element to that of the first, m.
  Vec3 difference = Vec3::Zero();
};

/// Returns the closest points of the point x[0] and the triangle x[1], x[2], x[3], which may be degenerate.
ClosestPoints closest_point_triangle(const FourPoints& x);
/// Returns the closest points of the edges x[0] x[1] and x[2] x[3], which may be parallel or of length zero.
ClosestPoints closest_edge_edge(const FourPoints& x);

/// Returns the barycentric weights of the point of the triangle abc that is nearest to `x`. The triangle may
/// be degenerate.
Vec3 nearest_weights(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x);
/// Returns the barycentric weights of the point of the edge ab that is nearest to `x`. The edge may have
/// length zero.
Vec2 nearest_weights(const Vec3& a, const Vec3& b, const Vec3& x);
/// Returns whether the triangle abc is an edge or a point: the squared sine of its angle at `a` is rounding,
/// or a side at `a` has length zero.
bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c);

/// Returns the sum of `values` at four corners times their weights.
inline Vec3 weighted(const std::array<double, 4>& weight, const FourPoints& values) {
  return weight[0] * values[0] + weight[1] * values[1] + weight[2] * values[2] + weight[3] * values[3];
}

}  // namespace duet
