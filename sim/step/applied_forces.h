// Forces that the caller of the simulator applies to bodies, besides those that the scene calls for.
#pragma once

#include <vector>

#include "sim/state/bodies.h"

namespace duet {

/// Forces from outside that act in every step until they are cleared.
///
/// The arrays are empty until the first force is added, and `any` is false while no force acts: the stages
/// that apply forces are then not entered.
struct AppliedForces {
  bool any = false;            ///< true if a force acts
  std::vector<Vec3> particle,  ///< N, world axes, per particle
      linear,                  ///< N, world axes, per rigid body, at its center of mass
      angular;                 ///< N m, world axes, per rigid body, about its center of mass
  /// m/s^2, upper bound of the acceleration that the forces give to a point of a body; 0 without forces.
  ///
  /// The choice of the time step foresees it, as it foresees gravity.
  double acceleration = 0;

  /// Ends all forces. The arrays keep their storage.
  void clear();
};

/// Adds a force (N) at the center of mass and a moment (N m) about it, both in world axes, to dynamic body
/// `body`.
void add_to_rigid(const Bodies& bodies, std::size_t body, const Vec3& force, const Vec3& moment,
                  AppliedForces& applied);
/// Adds `force` (N, world axes) to deformable body `body`, distributed over its particles by mass.
///
/// All particles that are not held get the same acceleration.
void add_to_deformable(const Bodies& bodies, std::size_t body, const Vec3& force, AppliedForces& applied);
/// Adds `force` (N, world axes) to particle `p`. If a dynamic body carries the particle, the force acts on
/// that body; it is without effect on other particles that are held.
void add_to_particle(const Bodies& bodies, std::size_t p, const Vec3& force, AppliedForces& applied);

}  // namespace duet
