#include "sim/deformable/self_contact/initial_proximity.h"

#include <algorithm>

#include "sim/base/assert.h"
#include "sim/geometry/queries/closest_points.h"

namespace duet {
namespace {

// Initial distance, relative to h, below which parts of a body may belong near each other.
constexpr double nearest_apart = 1.5;
// Length of the way along a body, relative to h, from which its parts do not belong near each other. A half
// circle with the diameter 1.5 h is 2.4 h long.
constexpr double longest_way = 3;

// The particles to which a way along edges from the first element of a pair leads.
class Ways {
 public:
  Ways(const CollisionSurface& surface, double longest) : surface_(surface), longest_(longest) {}

  // Adds a particle with a way of the length zero.
  void begin(int particle) { reach(particle, 0); }

  // Returns whether a way leads to one of the `count` particles from `target` on, or there are too many to
  // tell.
  bool leads_to(const int* target, std::size_t count) {
    for (std::size_t next = 0; next < count_; ++next) {
      const Way here = ways_[next];
      if (std::find(target, target + count, here.particle) != target + count) return true;
      for (const int e : surface_.edges_around.of(here.particle)) {
        const auto& [a, b] = surface_.edges[as_index(e)];
        const double length = (surface_.initial[as_index(a)] - surface_.initial[as_index(b)]).norm();
        if (here.length + length > longest_) continue;
        if (!reach(a == here.particle ? b : a, here.length + length)) return true;
      }
    }
    return false;
  }

 private:
  static constexpr std::size_t most = 64;
  struct Way {
    int particle;
    double length;  // m
  };

  // Notes a way to a particle, unless a shorter one is known. Returns false if there is no more room.
  bool reach(int particle, double length) {
    for (std::size_t i = 0; i < count_; ++i)
      if (ways_[i].particle == particle) {
        if (ways_[i].length <= length) return true;
        break;  // the shorter way is followed, too
      }
    if (count_ == most) return false;
    ways_[count_++] = {particle, length};
    return true;
  }

  const CollisionSurface& surface_;
  double longest_;  // m
  std::array<Way, most> ways_{};
  std::size_t count_ = 0;
};

}  // namespace

double initial_distance(const CandidatePair& pair, const CollisionSurface& surface) {
  return closest_points(pair.kind, corners(pair.particle, surface.initial)).difference.norm();
}

InitialProximity initial_proximity(const CandidatePair& pair, bool is_one_body,
                                   const CollisionSurface& surface) {
  if (!is_one_body || initial_distance(pair, surface) >= nearest_apart * pair.thickness)
    return InitialProximity::apart;
  DUET_ASSERT(!surface.edges_around.first.empty());
  const std::size_t first = pair.kind == ElementPair::point_triangle ? 1 : 2;
  Ways ways(surface, longest_way * pair.thickness);
  for (std::size_t i = 0; i < first; ++i) ways.begin(pair.particle[i]);
  return ways.leads_to(pair.particle.data() + first, 4 - first) ? InitialProximity::belonging
                                                                : InitialProximity::lying;
}

}  // namespace duet
