#include "sim/contact/detection/max_penetration.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/base/parallel.h"
#include "sim/contact/detection/near_visits.h"

namespace duet {
namespace {

constexpr std::size_t measured_at_once = 16;  // for each task of the parallel loop

}  // namespace

double max_penetration(const Bodies& bodies, const CandidateFilter& filter) {
  CandidateSearch search;
  bound_bodies(bodies, search.broad_phase.bounds);
  search.broad_phase.margin.assign(search.broad_phase.bounds.size(), 0);
  const std::vector<BodyPair>& pairs = search.broad_phase.find(filter);
  place_points(bodies, pairs, search);
  const double least = parallel_reduce(
      pairs.size(), measured_at_once, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double deepest = 0;
        const auto look = [&](const NearPoint& near, const Vec3& = {}) {
          deepest = std::min(deepest, near.gap);
        };
        for (std::size_t i = begin; i < end; ++i) {
          if (pairs[i].guest_rigid < 0) {
            if (is_excluded_deformable(bodies, pairs[i].host, pairs[i].guest_deformable)) continue;
            const double around = bodies.deformable[as_index(pairs[i].guest_deformable)].thickness / 2;
            const auto h = as_index(pairs[i].host);
            visit_near(bodies, search, pairs[i], around, [&](NearPoint near) {
              if (neither_moves(bodies, bodies.points[as_index(near.feature.index)], h)) return;
              near.gap -= around;
              look(near);
            });
            CandidateSearch::Chunk scratch;
            ContactPoint contact;
            visit_places(
                bodies, search.broad_phase, pairs[i], around, [&](const BoundaryEdge&) { return around; },
                scratch,
                [&](const EdgeContact& near) {
                  contact.feature = near.feature;
                  contact.edge = near.edge;
                  put_on_surface(bodies, contact);
                  if (!neither_moves(bodies, contact.on_surface, h))
                    deepest = std::min(deepest, near.distance - around);
                });
            continue;
          }
          if (is_excluded(bodies, pairs[i].host, pairs[i].guest_rigid)) continue;
          for (const PairDirection direction : {PairDirection::as_found, PairDirection::reversed}) {
            const BodyPair pair = direction == PairDirection::reversed ? reversed(pairs[i]) : pairs[i];
            if (search.broad_phase.bounds[as_index(pair.guest_rigid)].is_half_space) continue;
            // The grid of a mesh may lie above its faces, by a thousandth of a cell on bent ones.
            const LevelSet& host = bodies.rigid.properties[as_index(pair.host)].shape;
            visit_near(bodies.rigid, pair, 0, [&](const NearPoint& near, const Vec3&) {
              if (near.gap < deepest) deepest = std::min(deepest, host.exact(near.position).distance);
            });
            std::vector<EdgeContact> feature_edges;
            find_feature_edges(bodies, pair, direction, 0, feature_edges);
            for (const EdgeContact& near : feature_edges) deepest = std::min(deepest, near.distance);
          }
        }
        return deepest;
      },
      [](double a, double b) { return std::min(a, b); });
  return std::abs(least);  // not -0
}

}  // namespace duet
