// Bodies taken together as one rigid body, and the momentum that they lack.
#pragma once

#include "sim/deformable/spin.h"

namespace duet {

/// First everything is added, then finish() is called once; velocity_at() is what gives the composite its
/// momentum back. All sums are about the first place that is added, so that they keep their digits far from
/// the origin.
class CompositeBody {
 public:
  /// A mass m (kg) at x (m) that lacks a velocity (m/s).
  void add(double m, const Vec3& x, const Vec3& lacking);
  /// A rigid body's own inertia tensor (kg m^2, world axes), and what its angular velocity lacks (rad/s).
  void add_turning(const Mat3& inertia, const Vec3& lacking);
  /// The moment of an impulse (N s) at x (m), of those that have no sum.
  void add_moment(const Vec3& x, const Vec3& impulse);
  void finish();
  /// m/s, at x (m); zero where no mass was added.
  Vec3 velocity_at(const Vec3& x) const { return velocity_ + turn_.cross(x - place_ - moments_.centre); }
  /// rad/s.
  const Vec3& turn() const { return turn_; }

 private:
  Vec3 arm(const Vec3& x);

  bool has_place_ = false;
  Vec3 place_ = Vec3::Zero();     // m, about which moments are
  MassMoments moments_;           // until finish() the centre times the mass, and the inertia about the place
  Vec3 linear_ = Vec3::Zero();    // kg m/s, lacking
  Vec3 angular_ = Vec3::Zero();   // kg m^2/s, lacking
  Vec3 velocity_ = Vec3::Zero();  // m/s, of the centre
  Vec3 turn_ = Vec3::Zero();      // rad/s
};

}  // namespace duet
