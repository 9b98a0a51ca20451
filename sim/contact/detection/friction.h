// Impulses with Coulomb friction: sticking is tried first, then sliding (Guendelman, Bridson, Fedkiw 2003).
#pragma once

#include "sim/base/types.h"

namespace duet {

// What an impulse at a contact does to the relative velocity there.
struct ContactResponse {
  Mat3 K = Mat3::Zero();         // 1/kg, change of relative velocity per impulse
  double normal_mass = 0;        // kg, 1 / (n.K n)
  Mat3 sticking = Mat3::Zero();  // kg, tangential impulse per tangential velocity to be stopped by it alone

  ContactResponse() = default;
  ContactResponse(const Mat3& K, const Vec3& normal);
};

struct FrictionContact {
  Vec3 normal;  // unit, from host to guest
  ContactResponse response;
  double friction;  // Coulomb coefficient
};

// The impulse (N s, on the guest) after which the normal relative velocity is `target`, if the relative
// velocity before it is `velocity`; zero if the bodies separate faster than that anyway. Sticking removes all
// tangential velocity; where that would need more than friction * normal impulse, the bodies slide.
Vec3 friction_impulse(const FrictionContact& contact, const Vec3& velocity, double target);

// The largest part of `impulse` that does not add kinetic energy, for the relative velocity before it.
Vec3 limit_energy(const Mat3& K, const Vec3& velocity, const Vec3& impulse);

}  // namespace duet
