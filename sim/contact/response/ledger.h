// The ledger of momentum and energy: what every stage of a step gives to all bodies together, and how much of
// that comes from outside. The difference is a defect of the stage.
#pragma once

#include "sim/contact/graph/contact_graph.h"

namespace duet {

/// The entry of a stage that changes velocities, summed over the steps of a frame. Momenta are about the
/// origin. Bodies of infinite mass have no momentum: what they give to others counts as external, as gravity
/// does.
struct LedgerEntry {
  Momentum gained;           ///< Momentum that all bodies gained in the stage.
  Momentum external;         ///< The part of `gained` that came from outside.
  double kinetic = 0;        ///< Kinetic energy gained, J.
  double stored = 0;         ///< Elastic energy and energy of gravity gained, J.
  double linear_defect = 0,  ///< Largest |gained - external| of linear momentum in one step, kg m/s.
      angular_defect = 0;    ///< Largest |gained - external| of angular momentum in one step, kg m^2/s.
  /// Adds the momenta of one step and updates the defects.
  void add(const Momentum& gain, const Momentum& from_outside);
};

/// The entry of a stage that changes positions, summed over the steps of a frame, for the bodies of finite
/// mass.
struct DisplacementEntry {
  Momentum moved;  ///< Sum of m dx (`linear`, kg m) and of m x cross dx + I theta (`angular`, kg m^2).
  double linear_largest = 0,  ///< Largest |sum m dx| in one step, kg m.
      angular_largest = 0;    ///< Largest |sum m x cross dx + I theta| in one step, kg m^2.
  /// Adds the displacement of one step.
  void add(const Momentum& step);
};

/// Adds both momenta of `b` to those of `a`.
Momentum& operator+=(Momentum& a, const Momentum& b);
/// Returns the differences of both momenta.
Momentum operator-(const Momentum& a, const Momentum& b);

/// Returns the momentum of all rigid bodies and of all particles that are not held, with the particles at `x`
/// (m) instead of their present positions.
Momentum momentum(const Bodies& bodies, const std::vector<Vec3>& x);
/// Returns the impulse of `gravity` (m/s^2) over `dt` (s) on all bodies, with the particles at `x` (m).
Momentum gravity_impulse(const Bodies& bodies, const std::vector<Vec3>& x, const Vec3& gravity, double dt);
/// Returns what static and kinematic bodies and held particles give to the others by the impulses that the
/// contacts of `pairs` (indices into contacts.pairs) hold now, at the arms that the contacts hold.
Momentum contact_impulse(const Bodies& bodies, const ContactSet& contacts, const std::vector<int>& pairs);
/// Returns sum m dx (`linear`, kg m) and sum m x cross dx + I theta (`angular`, kg m^2) of the bodies of
/// finite mass, which moved from the particle positions `x` (m) and the states `rigid` to the present ones.
Momentum displacement(const Bodies& bodies, const std::vector<Vec3>& x, const std::vector<RigidState>& rigid);

}  // namespace duet
