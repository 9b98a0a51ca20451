#include "sim/scene/build/overlap_exit.h"

#include <cmath>
#include <limits>
#include <optional>

namespace duet {
namespace {

constexpr double unlimited = std::numeric_limits<double>::infinity();
// Relative error of depths while a body is moved out of another. A larger value measures faster and less
// exactly.
constexpr double coarse = 0.25;
// Largest number of displacements along the normals of the deepest points, see along_normals().
constexpr int walk_steps = 32;
// Length of a walk, as a multiple of the depth, up to which it is taken without trying other directions: no
// displacement is shorter than the depth.
constexpr double short_walk = 1.05;
// Largest number of displacements along one direction, see along_direction().
constexpr int max_strides = 100;
// Depth that rules a direction out, over that by which its displacement would reach the shortest one known.
// It is below 1 so that directions with displacements of the same length apart from rounding end early.
constexpr double least_gain = 1 - 1e-6;
// Largest number of constraints on a displacement, see within(), and of Gauss-Seidel sweeps over them.
constexpr int max_cuts = 32, cut_sweeps = 1000;
// Largest violation of a constraint, over the longest displacement that one of them demands, at which a
// displacement meets them all.
constexpr double cut_tolerance = 1e-6;
// Fraction of the thinner body's thickness by which bodies move in any case. Bodies that touch apart from
// rounding may need several times their depth.
constexpr double near_exit = 0.02;
// Fraction of the other body's thickness up to which a surface that crosses it returns by deformation. At
// half of it the surface is in the middle, from where points return to either side.
constexpr double slight = 0.25;

// A constraint on a displacement u: normal . u >= length.
struct Cut {
  Vec3 normal;
  double length;  // m
};

// Returns the shortest displacement (m) that meets all constraints, by Gauss-Seidel sweeps over their
// multipliers (Hildreth 1957); none if the sweeps do not converge, as if two normals are opposite.
std::optional<Vec3> shortest(const std::vector<Cut>& cuts) {
  Vec3 u = Vec3::Zero();
  std::vector<double> push(cuts.size(), 0);
  double longest = 0;
  for (const Cut& cut : cuts) longest = std::max(longest, cut.length);
  for (int sweep = 0; sweep < cut_sweeps; ++sweep) {
    double most = 0;  // m, largest change of the displacement
    for (std::size_t i = 0; i < cuts.size(); ++i) {
      const double change = std::max(-push[i], cuts[i].length - cuts[i].normal.dot(u));
      push[i] += change;
      u += change * cuts[i].normal;
      most = std::max(most, std::abs(change));
    }
    if (most <= cut_tolerance * longest) return u;
  }
  return std::nullopt;
}

// The search for the displacement by which `b` leaves `a`.
class ExitSearch {
 public:
  ExitSearch(OverlapProbe& probe, int a, int b, const Vec3& start)
      : probe_(probe), a_(a), b_(b), start_(start) {}

  // Returns the displacement (m) that takes b out of a by moving b along the normal at the deepest point by
  // the depth there, again and again. Zero if that does not end outside within a path of `bound` (m).
  Vec3 along_normals(OverlapProbe::Deepest deepest, double bound) {
    Vec3 way = Vec3::Zero();
    double path = 0;
    for (int i = 0; i < walk_steps && path <= bound; ++i) {
      way += beyond_surface * deepest.depth * deepest.way;
      path += deepest.depth;
      deepest = at(way);
      if (deepest.depth == 0) return way;
    }
    return Vec3::Zero();
  }

  // Returns how far (m) b has to move along `direction` to leave a. Each stride is as long as the current
  // depth, which is a lower bound of what is left. Infinite if the distance exceeds `bound`.
  double along_direction(const Vec3& direction, double bound) {
    double length = 0;
    for (int i = 0; i < max_strides && length < bound; ++i) {
      const double depth = at(length * direction, least_gain * (bound - length)).depth;
      if (depth == 0) return length;
      length += beyond_surface * depth;
    }
    return unlimited;
  }

  // Returns the shortest displacement (m) that takes b out of a, if it is no longer than `bound` (m), which
  // is small against the bodies; else zero. The deepest points at the displacements that have been tried are
  // constraints on the next one.
  Vec3 within(double bound) {
    std::vector<Cut> cuts;
    Vec3 way = Vec3::Zero();
    for (int i = 0; i < max_cuts; ++i) {
      const OverlapProbe::Deepest deepest = at(way);
      if (deepest.depth == 0) return way;
      cuts.push_back({deepest.way, deepest.way.dot(way) + beyond_surface * deepest.depth});
      const std::optional<Vec3> next = shortest(cuts);
      if (!next || next->norm() > bound) break;
      way = *next;
    }
    return Vec3::Zero();
  }

 private:
  // Returns the overlap with b displaced by `way` (m). A depth of `enough` (m) need not be the largest.
  OverlapProbe::Deepest at(const Vec3& way, double enough = unlimited) {
    return probe_.deepest_to_rest(a_, b_, start_ + way, coarse, enough);
  }

  OverlapProbe& probe_;
  int a_, b_;
  Vec3 start_;  // m, displacement of b against a at the start
};

}  // namespace

Vec3 shortest_exit(OverlapProbe& probe, int a, int b, const Vec3& shift,
                   const OverlapProbe::Deepest& deepest) {
  ExitSearch search(probe, a, b, shift);
  const bool deforms = !probe.both_rigid(a, b) && probe.crossed_fraction(a, b, deepest.depth) <= slight;
  const double at_once = short_walk * deepest.depth;
  const Vec3 walk = search.along_normals(deepest, deforms ? at_once : unlimited);
  if (!walk.isZero(0) && walk.norm() <= at_once) return walk;
  if (deforms)
    return search.within(far_exit * (deepest.depth + probe.rest_distance(a, b)) +
                         near_exit * probe.thinner(a, b));
  Vec3 shortest = walk;
  double length = walk.isZero(0) ? unlimited : walk.norm();
  std::vector<Vec3> directions = probe.directions(a, b, shift);
  directions.insert(directions.begin(), deepest.way);
  for (const Vec3& direction : directions) {
    const double stride = search.along_direction(direction, length);
    if (stride < length) {
      length = stride;
      shortest = stride * direction;
    }
  }
  return shortest;
}

}  // namespace duet
