#include "sim/geometry/queries/continuous_collision.h"

#include <algorithm>
#include <limits>

#include "sim/base/assert.h"

namespace duet {
namespace {

// Bound on the number of planes that are tried. Beyond it the test reports an impact, which is safe.
constexpr int max_planes = 100;
// Distance in gaps below which elements count as meeting. A smaller value takes more planes; a larger one
// stops elements earlier.
constexpr double contact = 1.25;
// Bound on the rounding error of a projection on n of corners within 1 of the origin: that of the current
// corner, of the products and of the sums.
constexpr double rounding = 32 * std::numeric_limits<double>::epsilon();

// Returns the largest magnitude of a coordinate.
double max_coordinate(const FourPoints& x) {
  double largest = 0;
  for (const Vec3& corner : x) largest = std::max(largest, corner.lpNorm<Eigen::Infinity>());
  return largest;
}

// The distances of the corners of the first element from those of the second one along a normal, and their
// rates.
struct Projection {
  // Current corners (m), and their motion over the whole of [0, 1] (m).
  FourPoints corner, motion;
  std::size_t first;  // number of corners of the first element

  // Calls visit(current gap, its rate) for every pair of corners of the two elements.
  template <class Visit>
  void for_each_pair(const Vec3& normal, Visit&& visit) const {
    for (std::size_t i = 0; i < first; ++i)
      for (std::size_t k = first; k < 4; ++k)
        visit(normal.dot(corner[i] - corner[k]), normal.dot(motion[i] - motion[k]));
  }
  // Returns the least gap of all pairs, which a plane across the normal has now.
  double separation(const Vec3& normal) const {
    double least = std::numeric_limits<double>::infinity();
    for_each_pair(normal, [&](double now, double) { least = std::min(least, now); });
    return least;
  }
  // Returns how long that plane keeps at least `gap`; infinity if no pair approaches.
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
  DUET_ASSERT(gap > 0);
  // The corners at the start, relative to one of them, which reduces rounding far from the origin of the
  // world.
  FourPoints origin;
  Projection now{{}, {}, kind == ElementPair::point_triangle ? std::size_t{1} : std::size_t{2}};
  for (std::size_t i = 0; i < 4; ++i) {
    origin[i] = start[i] - start[0];
    now.motion[i] = end[i] - start[i];
  }
  const double error = rounding * (max_coordinate(origin) + max_coordinate(now.motion));
  const double kept = gap + error;
  Impact impact;
  for (int plane = 0; plane < max_planes; ++plane) {
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
