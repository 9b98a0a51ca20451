// Bodies taken together as one rigid body, and the momentum that they lack.
#pragma once

#include "sim/base/types.h"

namespace duet {

// First add() everything, then finish() once; velocity_at() is what gives the composite its momentum back.
struct CompositeBody {
  double mass = 0;              // kg
  Vec3 centre = Vec3::Zero();   // m; until finish() all moments are about the origin, and this times the mass
  Vec3 linear = Vec3::Zero();   // kg m/s, lacking
  Vec3 angular = Vec3::Zero();  // kg m^2/s, lacking
  Mat3 inertia = Mat3::Zero();  // kg m^2
  Vec3 velocity = Vec3::Zero();  // m/s, from here on after finish()
  Vec3 turn = Vec3::Zero();      // rad/s

  // A mass m (kg) at x (m) that lacks a velocity (m/s).
  void add(double m, const Vec3& x, const Vec3& lacking);
  void finish();
  Vec3 velocity_at(const Vec3& x) const { return velocity + turn.cross(x - centre); }
};

}  // namespace duet
