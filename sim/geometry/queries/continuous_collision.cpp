#include "sim/geometry/queries/continuous_collision.h"

#include <algorithm>
#include <limits>

namespace duet {
namespace {

constexpr int most_planes = 100;
constexpr double contact = 1.25;  // times the gap: nearer than that is an impact
// Rounding of a projection on n of corners within 1 of the origin: of the corner now, the products, the sums.
constexpr double rounding = 32 * std::numeric_limits<double>::epsilon();

double largest_coordinate(const FourPoints& x) {
  double largest = 0;
  for (const Vec3& corner : x) largest = std::max(largest, corner.lpNorm<Eigen::Infinity>());
  return largest;
}

// What the first element's corners lie beyond the second one's, along one normal.
struct Projection {
  FourPoints corner, motion;  // motion over the whole of [0, 1]
  std::size_t first;          // corners of the first element

  template <class Visit>  // visit(gap now, its rate) for every pair of corners
  void for_each_pair(const Vec3& normal, Visit&& visit) const {
    for (std::size_t i = 0; i < first; ++i)
      for (std::size_t k = first; k < 4; ++k)
        visit(normal.dot(corner[i] - corner[k]), normal.dot(motion[i] - motion[k]));
  }
  double separation(const Vec3& normal) const {
    double least = std::numeric_limits<double>::infinity();
    for_each_pair(normal, [&](double now, double) { least = std::min(least, now); });
    return least;
  }
  // How long it stays at least `gap`.
  double time_apart(const Vec3& normal, double gap) const {
    double time = std::numeric_limits<double>::infinity();
    for_each_pair(normal, [&](double now, double rate) {
      if (rate < 0) time = std::min(time, (now - gap) / -rate);
    });
    return time;
  }
};

}  // namespace

ClosestPoints closest_points(ElementPair kind, const FourPoints& x) {
  return kind == ElementPair::point_triangle ? closest_point_triangle(x) : closest_edge_edge(x);
}

std::optional<Impact> first_impact(ElementPair kind, const FourPoints& start, const FourPoints& end,
                                   double gap) {
  FourPoints
      origin;  // the corners at the start, about one of them: far from the world's origin, less rounding
  Projection now{{}, {}, kind == ElementPair::point_triangle ? std::size_t{1} : std::size_t{2}};
  for (std::size_t i = 0; i < 4; ++i) {
    origin[i] = start[i] - start[0];
    now.motion[i] = end[i] - start[i];
  }
  const double error = rounding * (largest_coordinate(origin) + largest_coordinate(now.motion));
  const double kept = gap + error;
  Impact impact;
  for (int plane = 0; plane < most_planes; ++plane) {
    for (std::size_t i = 0; i < 4; ++i) now.corner[i] = origin[i] + impact.time * now.motion[i];
    impact.at = closest_points(kind, now.corner);
    const double distance = impact.at.difference.norm();
    if (!(distance > 0)) {
      impact.normal.setZero();
      return impact;
    }
    impact.normal = impact.at.difference / distance;
    if (now.separation(impact.normal) < contact * kept) return impact;
    impact.time += now.time_apart(impact.normal, kept);
    if (impact.time >= 1) return std::nullopt;
  }
  return impact;
}

}  // namespace duet
