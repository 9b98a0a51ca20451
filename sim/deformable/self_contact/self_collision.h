// Self-collisions (paper section 6, in step IV; Bridson et al. 2002): finds end positions to which deformable
// surfaces, of one body or of several, move without crossing, from positions in which none cross.
#pragma once

#include "sim/deformable/self_contact/collision_candidates.h"
#include "sim/deformable/self_contact/impact_zones.h"

namespace duet {

/// Resolves collisions between deformable surfaces.
class SelfCollision {
 public:
  /// Statistics and failure of resolve().
  struct Outcome {
    std::int64_t impulses = 0;  ///< number of impulses that were applied
    int zone_particles = 0;     ///< number of particles that impact zones had to move
    /// the particles of a pair that held particles (inverse mass 0) force to cross; empty on success
    std::optional<std::array<int, 4>> unresolved;
  };

  /// Changes the end positions `end` (m) until no pair of elements meets on its way along straight lines from
  /// `start` (m).
  ///
  /// Impulses on single pairs are tried first, then rigid impact zones. Both keep linear momentum; impulses
  /// keep angular momentum about `start` to second order in the displacements, zones exactly. Elements stay
  /// apart by half of their distance at the start, or by half of a tenth of their thickness if that is less;
  /// so `end` is free of intersections if `start` is. `inverse_mass` is in 1/kg. If held particles force a
  /// pair to cross, resolve() stops and names the pair in the outcome.
  Outcome resolve(const CollisionSurface& surface, const std::vector<Vec3>& start,
                  const std::vector<double>& inverse_mass, CollisionCandidates& candidates,
                  std::vector<Vec3>& end);

 private:
  // Finds the candidates for which concerned(pair) holds and that meet; their indices go to impacts_.
  template <class Filter>
  void find_impacts(const CollisionCandidates& candidates, const std::vector<Vec3>& start,
                    const std::vector<Vec3>& end, Filter&& concerned);

  CollectScratch<int> ranges_;
  std::vector<int> impacts_;  // indices of candidates
  // For each particle: moved in the previous round; moved in this round.
  std::vector<char> moved_, moves_;
  ImpactZones zones_;
};

}  // namespace duet
