// The impact of a round of step II.1: the impulses of all points of rigid pairs that meet at once are found
// together.
#pragma once

#include "sim/contact/response/collisions.h"

namespace duet {

/// Finds and applies the impulses of an impact, whose pairs are CollisionScratch::impact.
class ImpactSolve {
 public:
  /// For one call of process_collisions(), whose parameters these are.
  ImpactSolve(Bodies& bodies, const VelocityState& difference, double dt, ArticulatedResponse* linked,
              ContactSet& contacts, CollisionScratch& scratch)
      : bodies_(bodies),
        difference_(difference),
        dt_(dt),
        linked_(linked),
        contacts_(contacts),
        scratch_(scratch) {}

  /// Finds the impulses of all points that take part, by Gauss-Seidel sweeps, and applies them. The tolerance
  /// of each island is a fraction of its fastest approach.
  void run();

  /// Returns the part of D in the velocity of the guest relative to the host, m/s: what forces and prescribed
  /// motions of the step add.
  Vec3 change_by_forces(const ContactPoint& contact) const;
  /// Applies an impulse (N s) on the guest of a contact, and the opposite one on its host.
  void apply(const ContactPoint& contact, const Vec3& impulse);
  /// Notes that an impulse has changed the velocity of a rigid body, or of its jointed group.
  void mark_changed(int body);
  /// Calls visit(i) for the indices i of the points of a pair that take part in the impact.
  template <class Visit>
  void for_each_point(const ContactPair& pair, Visit&& visit) {
    for (int i = pair.begin; i < pair.end; ++i)
      if (scratch_.takes_part[as_index(i)] != 0) visit(as_index(i));
  }

 private:
  template <class Pair>
  std::size_t island_of(const Pair& pair) const {
    const bool host_moves = bodies_.rigid.properties[as_index(pair.host)].is_dynamic();
    return as_index(scratch_.joined.first(host_moves ? pair.host : pair.guest_rigid));
  }

  // Calls visit(contact, meeting) for the contacts of the impact whose impulses act later.
  template <class Visit>
  void for_each_later(Visit&& visit) {
    for (const int p : scratch_.impact) {
      const double meeting = scratch_.islands[scratch_.island[as_index(p)]].meeting;
      for_each_point(contacts_.pairs[as_index(p)], [&](std::size_t i) {
        if (scratch_.acts_later[i]) visit(contacts_.points[i], meeting);
      });
    }
  }

  double approach_by_falls(const ContactPoint& contact) const;
  double delayed_rebound(const ContactPoint& contact, double normal_velocity, double meeting) const;
  double gain_of(std::size_t i) const;
  void find_islands();
  void delay_islands();
  void delay_impulses();
  void settle_islands();
  double update_pair(const ContactPair& pair, double tolerance);
  void keep_energy();

  Bodies& bodies_;
  const VelocityState& difference_;
  double dt_;
  ArticulatedResponse* linked_;
  ContactSet& contacts_;
  CollisionScratch& scratch_;
};

}  // namespace duet
