// Closest points of a point and a triangle and of two edges, as weights of their corners.
#pragma once

#include <array>

#include "sim/base/types.h"

namespace duet {

using FourPoints = std::array<Vec3, 4>;  // m: point and triangle, or one edge and the other

// The weights of the first element add up to 1, those of the second to -1, so that for any values at the
// corners (positions, velocities) their weighted sum is the difference first minus second between the two
// closest points.
struct ClosestPoints {
  std::array<double, 4> weight{};
  Vec3 difference = Vec3::Zero();  // m, from the point on the second element to that on the first
};

ClosestPoints closest_point_triangle(const FourPoints& x);  // of the point x0 and the triangle x1 x2 x3
ClosestPoints closest_edge_edge(const FourPoints& x);       // of the edges x0 x1 and x2 x3

// Barycentric weights of the point of the triangle abc, or of the edge ab, that is nearest to x. Triangles
// and edges may be degenerate.
Vec3 nearest_weights(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& x);
Vec2 nearest_weights(const Vec3& a, const Vec3& b, const Vec3& x);
// Whether the triangle abc is no more than an edge.
bool is_degenerate(const Vec3& a, const Vec3& b, const Vec3& c);

inline Vec3 weighted(const std::array<double, 4>& weight, const FourPoints& values) {
  return weight[0] * values[0] + weight[1] * values[1] + weight[2] * values[2] + weight[3] * values[3];
}

}  // namespace duet
