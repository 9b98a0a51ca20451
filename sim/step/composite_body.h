// A set of bodies taken together as one rigid body, and the rigid motion that makes up for momentum it lacks.
#pragma once

#include "sim/deformable/spin.h"

namespace duet {

/// Masses taken together as one rigid body, and the rigid motion that carries the momentum they lack.
///
/// First everything is added, then finish() is called once; then velocity_at() and turn() are the velocities
/// that give the composite its missing linear and angular momentum. All sums are about the first place that
/// is added, so that they keep their digits far from the origin.
class CompositeBody {
 public:
  /// Adds a mass `m` (kg) at `x` (m) whose velocity falls short by `lacking` (m/s).
  void add(double m, const Vec3& x, const Vec3& lacking);
  /// Adds a rigid body's `inertia` about its center (kg m^2, world axes), whose angular velocity falls short
  /// by `lacking` (rad/s).
  void add_turning(const Mat3& inertia, const Vec3& lacking);
  /// Adds the moment of an `impulse` (N s) at `x` (m) to the angular momentum that is missing.
  ///
  /// The impulses of all calls add up to nothing; only their moments count.
  void add_moment(const Vec3& x, const Vec3& impulse);
  /// Computes the rigid motion from all that was added.
  void finish();
  /// Returns the velocity (m/s) of the rigid motion at `x` (m); zero if no mass was added.
  Vec3 velocity_at(const Vec3& x) const { return velocity_ + turn_.cross(x - place_ - moments_.center); }
  /// Returns the angular velocity (rad/s, world axes) of the rigid motion.
  const Vec3& turn() const { return turn_; }

 private:
  // Returns `x` relative to place_, which the first call sets.
  Vec3 arm(const Vec3& x);

  bool has_place_ = false;     // true if place_ is set
  Vec3 place_ = Vec3::Zero();  // m, world: the point that all moments are about
  MassMoments moments_;  // relative to place_; until finish(), mass times center, and inertia about place_
  Vec3 linear_ = Vec3::Zero();    // kg m/s, missing linear momentum
  Vec3 angular_ = Vec3::Zero();   // kg m^2/s, missing angular momentum
  Vec3 velocity_ = Vec3::Zero();  // m/s, of the center of mass
  Vec3 turn_ = Vec3::Zero();      // rad/s, world axes
};

}  // namespace duet
