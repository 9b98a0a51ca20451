#include "sim/deformable/self_contact/self_repulsion.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "sim/base/assert.h"
#include "sim/base/parallel.h"

namespace duet {
namespace {

// Number of candidates in a chunk of a parallel loop.
constexpr std::size_t repulsions_at_once = 512;
// Largest distance of the rows of a solve, relative to h. Pairs that are farther away still have to approach,
// and damping is to act on how fast they do: rows at 1.02 h slow surfaces that slide over each other's meshes
// by three times as much.
constexpr double row_range = 1.001;

// Smallest barycentric weight of a particle for it to belong to a place on an element.
constexpr double min_weight = 1e-9;

// Sines of angles. `nearly_flat`: largest rise of the surface around a point that pressing makes flat, and
// largest angle between edges that count as parallel. `min_angle`: angles that rounding makes.
constexpr double nearly_flat = 0.1, min_angle = 1e-9;

// Returns how many particles the first element of a pair has.
int first_count(ElementPair kind) { return kind == ElementPair::point_triangle ? 1 : 2; }

// Returns whether the boxes of the two elements are farther apart than `range` (m), which is cheaper to
// compute than their closest points.
bool farther_than(double range, ElementPair kind, const FourPoints& x) {
  const auto first = as_index(first_count(kind));
  Eigen::AlignedBox3d a, b;
  for (std::size_t i = 0; i < 4; ++i) (i < first ? a : b).extend(x[i]);
  return a.squaredExteriorDistance(b) > range * range;
}

// Returns an upper bound on the speed (m/s) at which a point of one element approaches a point of the other.
double fastest_approach(ElementPair kind, const FourPoints& velocity) {
  const auto first = as_index(first_count(kind));
  double squared = 0;
  for (std::size_t i = 0; i < first; ++i)
    for (std::size_t k = first; k < 4; ++k)
      squared = std::max(squared, (velocity[i] - velocity[k]).squaredNorm());
  return std::sqrt(squared);
}

// Returns 1/(sum of w_i^2 / m_i), kg; 0 if all particles are held.
double effective_mass(const std::array<int, 4>& particle, const std::array<double, 4>& weight,
                      const std::vector<double>& inverse_mass) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) sum += weight[i] * weight[i] * inverse_mass[as_index(particle[i])];
  return sum > 0 ? 1 / sum : 0;
}

// Returns whether a pair may be a row of a solve and is near enough.
bool can_be_row(const RepulsionPair& pair) {
  return pair.may_be_row && pair.distance < row_range * pair.thickness;
}

// Returns the nearest point on a pair's first or second element, as the particles from `begin` to `end` that
// have a weight.
SurfacePoint place_of(const RepulsionPair& pair, std::size_t begin, std::size_t end) {
  SurfacePoint place;
  place.count = 0;
  for (std::size_t i = begin; i < end; ++i) {
    const double weight = std::abs(pair.weight[i]);
    if (!(weight > min_weight)) continue;
    place.particle[as_index(place.count)] = pair.particle[i];
    place.weight[as_index(place.count++)] = weight;
  }
  return place;
}

// Returns whether a place on a surface is a support point in the direction `toward`, or lies in a dent. In a
// dent no other direction is better: in the direction of the steepest face's normal the surface still rises
// by more than half as much.
bool supports(const ElementLists& around, const std::vector<Triangle>& triangles, const std::vector<Vec3>& x,
              const SurfacePoint& place, const Vec3& toward) {
  const Vec3 at = weighted(place, x);
  const FacesAround faces = look_around(around, triangles, x, place, at, toward);
  if (faces.rise <= nearly_flat) return true;
  if (faces.rise > max_rise) return false;
  return look_around(around, triangles, x, place, at, faces.steepest).rise > faces.rise / 2;
}

// Returns whether a candidate is the first of all candidates that have the same nearest places: a place at a
// corner or on an edge belongs to several triangles.
bool is_first(const RepulsionPair& pair, const SurfacePoint& place, const ElementLists& around,
              const std::vector<Triangle>& triangles) {
  if (place.count == 1 && place.particle[0] < pair.particle[0]) return false;  // if both are points
  for (const int t : around.of(place.particle[0])) {
    const Triangle& face = triangles[as_index(t)];
    if (!lies_on(place, face)) continue;
    return std::is_permutation(face.begin(), face.end(), pair.particle.begin() + 1);
  }
  return true;
}

// Returns whether the edges of a pair of volumes cross at the nearest points: these are neither ends of
// edges, nor are the edges side by side inside flat parts. In the other cases the ends of the edges carry the
// load: they are points that have pairs with faces.
bool cross(const RepulsionPair& pair, const SurfacePoint& first, const SurfacePoint& second,
           const std::vector<Vec3>& x, const ElementLists& around, const std::vector<Triangle>& triangles) {
  if (first.count == 1 || second.count == 1) return false;
  const Vec3 a = x[as_index(pair.particle[1])] - x[as_index(pair.particle[0])],
             b = x[as_index(pair.particle[3])] - x[as_index(pair.particle[2])];
  if (a.cross(b).squaredNorm() > nearly_flat * nearly_flat * a.squaredNorm() * b.squaredNorm()) return true;
  const auto is_feature_edge = [&](const SurfacePoint& place, const Vec3& toward) {
    return look_around(around, triangles, x, place, weighted(place, x), toward).rise < -nearly_flat;
  };
  return is_feature_edge(first, -pair.normal) && is_feature_edge(second, pair.normal);
}

// Returns whether a pair is one of the few that carry the load between surfaces. A point has a pair with the
// face that it is opposite to. It has pairs with other faces only if it is nearest to a corner or an edge
// beyond which no face rises by more than `most`, the sine of an angle.
bool can_touch(const RepulsionPair& pair, ElementPair kind, double most, const std::vector<Vec3>& x,
               const ElementLists& around, const std::vector<Triangle>& triangles) {
  const bool has_point = kind == ElementPair::point_triangle;
  const SurfacePoint first = place_of(pair, 0, has_point ? 1 : 2),
                     second = place_of(pair, has_point ? 1 : 2, 4);
  const bool is_volume = !around.of(second.particle[0]).empty(),
             are_volumes = is_volume && !around.of(first.particle[0]).empty();
  if (!supports(around, triangles, x, first, -pair.normal)) return false;
  if (has_point && is_volume && second.count < 3) {
    if (look_around(around, triangles, x, second, weighted(second, x), pair.normal).rise > most) return false;
    return !are_volumes || is_first(pair, second, around, triangles);
  }
  if (!supports(around, triangles, x, second, pair.normal)) return false;
  return has_point || !are_volumes || cross(pair, first, second, x, around, triangles);
}

// Says which elements of a pair move as predicted: contact that the prediction does not know of may hold one
// of them.
enum Moving { both, first_alone, second_alone };

// Returns the pair of a candidate at the first moment within `dt` (s) at which it is nearer than
// repulsion_range h and touches(pair) holds, or nothing. The moment is found by conservative advancement
// (Mirtich 1996), in advances of at least dt / `max_advances`, so that they cover the step.
template <class Touches>
std::optional<RepulsionPair> meeting(const CandidatePair& candidate, const FourPoints& start,
                                     const FourPoints& velocity, double dt, Touches&& touches) {
  constexpr int max_advances = 12;
  const double speed = fastest_approach(candidate.kind, velocity),
               range = repulsion_range * candidate.thickness;
  if (farther_than(range + dt * speed, candidate.kind, start)) return {};
  double time = 0;
  for (int advance = 0; advance < max_advances && time < dt; ++advance) {
    FourPoints at = start;
    for (std::size_t i = 0; i < 4; ++i) at[i] += time * velocity[i];
    const ClosestPoints closest = closest_points(candidate.kind, at);
    const double distance = closest.difference.norm();
    if (!(distance > 0)) return {};
    if (distance < range) {
      const Vec3 normal = closest.difference / distance;
      const double gap = normal.dot(weighted(closest.weight, start));
      const RepulsionPair pair{
          candidate.particle,         closest.weight, normal, gap, candidate.thickness, candidate.friction,
          first_count(candidate.kind)};
      if (touches(pair)) return pair;
    }
    if (!(speed > 0)) return {};
    time += std::max((distance - candidate.thickness) / speed, dt / max_advances);
  }
  return {};
}

}  // namespace

Vec3 relative_velocity(const RepulsionPair& pair, const std::vector<Vec3>& v) {
  return weighted(pair.weight, corners(pair.particle, v));
}

void SelfRepulsion::find(const CollisionCandidates& candidates, const std::vector<Vec3>& x,
                         const std::vector<double>& inverse_mass, const ElementLists& around,
                         const std::vector<Triangle>& triangles) {
  const std::vector<CandidatePair>& near = candidates.near();
  parallel_collect(
      near.size(), repulsions_at_once, ranges_, pairs_,
      [&](std::size_t i, std::vector<RepulsionPair>& found) {
        const CandidatePair& candidate = near[i];
        const double range = repulsion_range * candidate.thickness;
        const FourPoints at = corners(candidate.particle, x);
        if (!candidate.repels || farther_than(range, candidate.kind, at)) return;
        const ClosestPoints closest = closest_points(candidate.kind, at);
        const double distance = closest.difference.norm();
        if (distance >= range || !(distance > 0)) return;
        RepulsionPair pair{candidate.particle,  closest.weight,     closest.difference / distance, distance,
                           candidate.thickness, candidate.friction, first_count(candidate.kind)};
        if (!around.first.empty() && !can_touch(pair, candidate.kind, min_angle, x, around, triangles))
          return;
        pair.mass = pair.row_mass = effective_mass(pair.particle, pair.weight, inverse_mass);
        found.push_back(pair);
      });
}

void SelfRepulsion::find_approaching(const CollisionCandidates& candidates, const std::vector<Vec3>& x,
                                     const std::vector<Vec3>& v, double dt, const ElementLists& around,
                                     const std::vector<Triangle>& triangles) {
  DUET_ASSERT(dt > 0 && x.size() == v.size());
  const std::vector<CandidatePair>& near = candidates.near();
  parallel_collect(
      near.size(), repulsions_at_once, ranges_, pairs_,
      [&](std::size_t number, std::vector<RepulsionPair>& found) {
        const CandidatePair& candidate = near[number];
        if (!candidate.repels) return;
        const FourPoints start = corners(candidate.particle, x), all = corners(candidate.particle, v);
        const auto touches = [&](const RepulsionPair& pair) {
          return around.first.empty() || can_touch(pair, candidate.kind, nearly_flat, x, around, triangles);
        };
        const auto first = as_index(first_count(candidate.kind));
        for (const Moving moving : {both, first_alone, second_alone}) {
          FourPoints velocity = all;
          for (std::size_t i = 0; i < 4; ++i)
            if (moving == (i < first ? second_alone : first_alone)) velocity[i].setZero();
          const std::optional<RepulsionPair> pair = meeting(candidate, start, velocity, dt, touches);
          if (pair) {
            found.push_back(*pair);
            return;
          }
        }
      });
}

namespace {

// Activates `pair` if it would come too near, see SelfRepulsion::activate_rows(), and sets its target.
void activate_row(double dt, double at, const std::vector<Vec3>& start, const std::vector<Vec3>& velocity,
                  RepulsionPair& pair) {
  const double from = relative_velocity(pair, start).dot(pair.normal),
               there = relative_velocity(pair, velocity).dot(pair.normal);
  pair.active = false;
  pair.active = can_be_row(pair) && from + (there - from) / at <= min_speed(pair, dt);
  pair.target = (1 - at) * from + at * min_speed(pair, dt);
}

}  // namespace

bool SelfRepulsion::activate_rows(double dt, double at, const std::vector<Vec3>& start,
                                  const std::vector<Vec3>& velocity) {
  DUET_ASSERT(dt > 0 && at > 0 && at <= 1 && start.size() == velocity.size());
  bool all = true;
  for (RepulsionPair& pair : pairs_) {
    activate_row(dt, at, start, velocity, pair);
    all = all && (pair.active || !can_be_row(pair));
  }
  return all;
}

bool SelfRepulsion::activate_more_rows(double dt, double at, const std::vector<Vec3>& start,
                                       const std::vector<Vec3>& velocity) {
  bool any = false;
  for (RepulsionPair& pair : pairs_) {
    if (pair.active) continue;
    activate_row(dt, at, start, velocity, pair);
    any = any || pair.active;
  }
  return any;
}

bool SelfRepulsion::deactivate_rows(const std::vector<Vec3>& change, double tolerance) {
  bool any = false;
  for (RepulsionPair& pair : pairs_) {
    if (!pair.active || relative_velocity(pair, change).dot(pair.normal) <= tolerance) continue;
    pair.active = false;
    any = true;
  }
  return any;
}

void SelfRepulsion::deactivate_all_rows() {
  for (RepulsionPair& pair : pairs_) pair.active = false;
}

void SelfRepulsion::use_inverse_masses(const std::vector<SymmetricBlock>* inverse_mass) {
  row_inverse_mass_ = inverse_mass;
  for (RepulsionPair& pair : pairs_) {
    pair.row_mass = pair.mass;
    if (!inverse_mass || !takes(pair)) continue;
    double sum = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const SymmetricBlock& inverse = (*inverse_mass)[as_index(pair.particle[i])];
      sum += pair.weight[i] * pair.weight[i] * pair.normal.dot(inverse * pair.normal);
    }
    pair.row_mass = sum > 0 ? 1 / sum : 0;
  }
}

void SelfRepulsion::sweep(ProjectTo goal, const std::vector<double>& inverse_mass,
                          std::vector<Vec3>& v) const {
  const auto project = [&](const RepulsionPair& pair) {
    if (!takes(pair)) return;
    const double speed = relative_velocity(pair, v).dot(pair.normal);
    const Vec3 impulse =
        pair.row_mass * ((goal == ProjectTo::targets ? pair.target : 0) - speed) * pair.normal;
    if (!row_inverse_mass_) {
      apply_impulse(pair, impulse, inverse_mass, v);
      return;
    }
    for (std::size_t i = 0; i < 4; ++i) {
      const auto p = as_index(pair.particle[i]);
      v[p] += pair.weight[i] * ((*row_inverse_mass_)[p] * impulse);
    }
  };
  std::for_each(pairs_.begin(), pairs_.end(), project);
  std::for_each(pairs_.rbegin(), pairs_.rend(), project);
}

}  // namespace duet
