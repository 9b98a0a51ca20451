// Rigid impact zones (Provot 1997; Bridson et al. 2002, section 7.3): groups of particles whose motion over a
// step is replaced by that of a rigid body, so that nothing within a group can collide.
#pragma once

#include <span>
#include <vector>

#include "sim/base/types.h"

namespace duet {

class ImpactZones {
 public:
  void clear(std::size_t particles);  // every particle alone

  // Puts the particles into one zone, with the zones they are in. Returns whether that joined anything.
  bool join(std::span<const int> particles);
  bool together(std::span<const int> particles) const;                      // in one zone
  int particle_count() const { return static_cast<int>(members_.size()); }  // in zones

  // Gives every zone the displacement from `start` to `end` of v + w x r that has its linear and angular
  // momentum about `start`. Along it no two particles come nearer to each other than at the start: the map
  // I + t w^* stretches what is across w and keeps the rest, which a turn along straight lines would not.
  // Particles without inverse mass stay where `end` has them and lead their zone. Returns false if they
  // cannot, as they do not move like a rigid body themselves.
  bool move(const std::vector<Vec3>& start, const std::vector<double>& inverse_mass, std::vector<Vec3>& end);

 private:
  int root(int particle) const;

  struct Zone {
    int root = -1;
    int begin = 0, end = 0;  // members_
  };
  void sort_members();

  std::vector<int> parent_;
  std::vector<int> members_;  // particles in zones
  std::vector<char> listed_;
  std::vector<Zone> zones_;
};

}  // namespace duet
