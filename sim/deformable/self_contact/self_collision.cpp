#include "sim/deformable/self_contact/self_collision.h"

#include <algorithm>

#include "sim/base/assert.h"
#include "sim/base/parallel.h"
#include "sim/base/stop.h"

namespace duet {
namespace {

// Number of candidates in a chunk of a parallel loop.
constexpr std::size_t collisions_at_once = 512;
// Largest number of rounds of impulses before impact zones take over.
constexpr int max_rounds = 8;
// Distance that impulses restore, relative to the pair's thickness; repulsions do the rest. A larger value
// would move particles farther than a collision requires.
constexpr double restored = 0.1;
// Smallest distance during the motion, relative to the distance to be restored.
constexpr double kept = 0.5;

// Returns whether the boxes that the two elements sweep are farther apart than `gap` (m).
bool pass_each_other(ElementPair kind, const FourPoints& start, const FourPoints& end, double gap) {
  const std::size_t first = kind == ElementPair::point_triangle ? 1 : 2;
  Eigen::AlignedBox3d a, b;
  for (std::size_t i = 0; i < 4; ++i) (i < first ? a : b).extend(start[i]).extend(end[i]);
  return a.squaredExteriorDistance(b) > gap * gap;
}

// First impact of a pair.
struct PairImpact {
  Impact impact;
  double distance;  // m, that the pair should have at the end
};

// Returns the first impact of a pair that moves from `start` to `end` (m), if there is one.
std::optional<PairImpact> impact_of(const CandidatePair& pair, const std::vector<Vec3>& start,
                                    const std::vector<Vec3>& end) {
  const FourPoints from = corners(pair.particle, start), to = corners(pair.particle, end);
  const double thickness = restored * pair.thickness;
  if (pass_each_other(pair.kind, from, to, thickness)) return std::nullopt;
  const double distance = std::min(thickness, closest_points(pair.kind, from).difference.norm());
  const std::optional<Impact> impact = first_impact(pair.kind, from, to, kept * distance);
  if (!impact) return std::nullopt;
  return PairImpact{*impact, distance};
}

// Moves the end positions so that the two points that meet are hit.distance apart along the normal. Returns
// whether anything moved.
bool push_apart(const CandidatePair& pair, const PairImpact& hit, const std::vector<double>& inverse_mass,
                std::vector<Vec3>& end) {
  const std::array<double, 4>& weight = hit.impact.at.weight;
  double inverse = 0;
  for (std::size_t i = 0; i < 4; ++i)
    inverse += weight[i] * weight[i] * inverse_mass[as_index(pair.particle[i])];
  const double lacking = hit.distance - hit.impact.normal.dot(weighted(weight, corners(pair.particle, end)));
  if (!(lacking > 0) || !(inverse > 0)) return false;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = as_index(pair.particle[i]);
    end[p] += weight[i] * inverse_mass[p] * lacking / inverse * hit.impact.normal;
  }
  return true;
}

}  // namespace

template <class Filter>
void SelfCollision::find_impacts(const CollisionCandidates& candidates, const std::vector<Vec3>& start,
                                 const std::vector<Vec3>& end, Filter&& concerned) {
  const std::vector<CandidatePair>& near = candidates.near();
  parallel_collect(near.size(), collisions_at_once, ranges_, impacts_,
                   [&](std::size_t i, std::vector<int>& found) {
                     if (concerned(near[i]) && impact_of(near[i], start, end))
                       found.push_back(static_cast<int>(i));
                   });
}

SelfCollision::Outcome SelfCollision::resolve(const CollisionSurface& surface, const std::vector<Vec3>& start,
                                              const std::vector<double>& inverse_mass,
                                              CollisionCandidates& candidates, std::vector<Vec3>& end) {
  DUET_ASSERT(start.size() == end.size() && start.size() == inverse_mass.size());
  Outcome outcome;
  moved_.assign(start.size(), 1);
  for (int round = 0; round < max_rounds; ++round) {
    stop_if_asked();
    candidates.update(surface, start, end);
    const std::vector<CandidatePair>& near = candidates.near();
    find_impacts(candidates, start, end, [&](const CandidatePair& pair) {
      return std::any_of(pair.particle.begin(), pair.particle.end(),
                         [&](int p) { return moved_[as_index(p)] != 0; });
    });
    if (impacts_.empty()) return outcome;
    moves_.assign(start.size(), 0);
    for (const int k : impacts_) {
      const CandidatePair& pair = near[as_index(k)];
      for (int p : pair.particle) moves_[as_index(p)] = 1;
      // Earlier impulses of this round may have resolved this impact.
      if (const auto hit = impact_of(pair, start, end))
        outcome.impulses += push_apart(pair, *hit, inverse_mass, end);
    }
    moved_.swap(moves_);
  }

  zones_.clear(start.size());
  while (true) {
    candidates.update(surface, start, end);
    const std::vector<CandidatePair>& near = candidates.near();
    find_impacts(candidates, start, end,
                 [&](const CandidatePair& pair) { return !zones_.together(pair.particle); });
    outcome.zone_particles = zones_.particle_count();
    if (impacts_.empty()) return outcome;
    for (const int k : impacts_) zones_.join(near[as_index(k)].particle);
    if (!zones_.move(start, inverse_mass, end)) {
      outcome.unresolved = near[as_index(impacts_.front())].particle;
      return outcome;
    }
  }
}

}  // namespace duet
