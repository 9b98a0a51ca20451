// Self-collisions (paper section 6, in step IV; Bridson et al. 2002): positions without a crossing of
// deformable surfaces, of one body or of several, from positions that have none.
#pragma once

#include "sim/deformable/self_contact/collision_candidates.h"
#include "sim/deformable/self_contact/impact_zones.h"

namespace duet {

class SelfCollision {
 public:
  struct Outcome {
    std::int64_t impulses = 0;
    int zone_particles = 0;  // that impact zones had to move
    std::optional<std::array<int, 4>>
        unresolved;  // a pair that particles without inverse mass force to cross
  };

  // Changes where the particles end up, until no pair meets on its way along straight lines from `start`:
  // impulses pair by pair while that helps, then rigid impact zones. Both keep linear momentum, and angular
  // momentum about `start` to second order in the displacements (zones: exactly).
  //
  // Elements stay apart by half of their distance at the start, or half of a tenth of their thickness if that
  // is less, so `end` is free of intersections if `start` is.
  Outcome resolve(const CollisionSurface& surface, const std::vector<Vec3>& start,
                  const std::vector<double>& inverse_mass, CollisionCandidates& candidates,
                  std::vector<Vec3>& end);

 private:
  struct Chunk {
    std::vector<int> impacts;  // indices of candidates
  };
  template <class Filter>
  void find_impacts(const CollisionCandidates& candidates, const std::vector<Vec3>& start,
                    const std::vector<Vec3>& end, Filter&& concerned);

  std::vector<Chunk> chunks_;
  std::vector<int> impacts_;
  std::vector<char> moved_, moves_;  // particles: since the last search, in this round
  ImpactZones zones_;
};

}  // namespace duet
