// Rigid impact zones (Provot 1997; Bridson et al. 2002, section 7.3): groups of particles whose motion over a
// step is replaced by that of a rigid body, so that nothing within a group can collide.
#pragma once

#include <span>
#include <vector>

#include "sim/base/disjoint_sets.h"
#include "sim/base/types.h"

namespace duet {

/// Disjoint groups of particles that are moved as rigid bodies.
class ImpactZones {
 public:
  /// Removes all zones; there are then `particles` particles, none of them in a zone.
  void clear(std::size_t particles);

  /// Joins the particles, and the zones that they are in, into one zone. Returns whether that changed
  /// anything.
  bool join(std::span<const int> particles);
  /// Returns whether the particles are all in one zone.
  bool together(std::span<const int> particles) const;
  /// Returns the number of particles that are in zones.
  int particle_count() const { return static_cast<int>(members_.size()); }

  /// Replaces the motion from `start` to `end` (m) of each zone by a rigid displacement v + w x r with the
  /// zone's linear and angular momentum about `start`.
  ///
  /// Along this displacement no two particles come nearer to each other than at the start: the map 1 + t w^*
  /// stretches what is perpendicular to w and keeps the rest, whereas a rotation along straight lines would
  /// bring them nearer. `inverse_mass` is in 1/kg. Particles with inverse mass 0 keep the position that `end`
  /// has for them, and their zone follows them. Returns false if a zone cannot follow, because its held
  /// particles do not move like a rigid body themselves.
  bool move(const std::vector<Vec3>& start, const std::vector<double>& inverse_mass, std::vector<Vec3>& end);

 private:
  // Range of members_ that belongs to one zone.
  struct Zone {
    int first = -1;          // its particle of the lowest number
    int begin = 0, end = 0;  // indices into members_
  };
  // Sorts members_ by zone and fills zones_.
  void sort_members();

  DisjointSets sets_;         // of the particles: the zones
  std::vector<int> members_;  // the particles that are in zones
  std::vector<char> listed_;  // by particle: whether it is in members_
  std::vector<Zone> zones_;
};

}  // namespace duet
