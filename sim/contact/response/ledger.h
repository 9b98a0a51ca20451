// The ledger of momentum and energy: what every stage of a step gives to all bodies together, and how much of
// that comes from outside. What is left over was made from nothing.
#pragma once

#include "sim/contact/graph/contact_graph.h"

namespace duet {

// Sums over the steps of a frame, about the origin. Bodies of infinite mass have no momentum: what they give
// to the others is from outside, as is gravity.
struct LedgerEntry {
  Momentum gained;
  Momentum external;
  double kinetic = 0;  // J gained
  double stored = 0;   // J gained, elastic and of gravity
  double linear_defect = 0,
         angular_defect = 0;  // kg m/s, kg m^2/s: the largest of gained - external in a step
  void add(const Momentum& gain, const Momentum& from_outside);
};

// What displacements move: sum m dx (kg m) and sum m x * dx + I theta (kg m^2) of the bodies of finite mass.
struct DisplacementEntry {
  Momentum moved;
  double linear_largest = 0, angular_largest = 0;  // in a step
  void add(const Momentum& step);
};

Momentum& operator+=(Momentum& a, const Momentum& b);
Momentum operator-(const Momentum& a, const Momentum& b);

// Of all bodies with the particles at `x` (m).
Momentum momentum(const Bodies& bodies, const std::vector<Vec3>& x);
// The impulse of gravity (m/s^2) over `dt` (s) on all bodies.
Momentum gravity_impulse(const Bodies& bodies, const std::vector<Vec3>& x, const Vec3& gravity, double dt);
// What bodies of infinite mass gave to the others by the impulses that the contacts of `pairs` (indices)
// hold now, at the arms that they have now.
Momentum contact_impulse(const Bodies& bodies, const ContactSet& contacts, const std::vector<int>& pairs);
// From the particles' positions and the rigid states before to those now.
Momentum displacement(const Bodies& bodies, const std::vector<Vec3>& x, const std::vector<RigidState>& rigid);

}  // namespace duet
