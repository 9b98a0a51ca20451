// Impulses with Coulomb friction: sticking is tried first, then sliding (Guendelman, Bridson, Fedkiw 2003).
#pragma once

#include "sim/base/types.h"

namespace duet {

struct FrictionContact {
  Vec3 normal;        // unit, from host to guest
  Mat3 K, inverse_K;  // 1/kg, kg: relative velocity per impulse and its inverse
  double friction;    // Coulomb coefficient
};

// The impulse (N s, on the guest) after which the normal relative velocity is `target`, if the relative
// velocity before it is `velocity`; zero if the bodies separate faster than that anyway. Sticking removes all
// tangential velocity; where that would need more than friction * normal impulse, the bodies slide.
Vec3 friction_impulse(const FrictionContact& contact, const Vec3& velocity, double target);

// The largest part of `impulse` that does not add kinetic energy, for the relative velocity before it.
Vec3 limit_energy(const Mat3& K, const Vec3& velocity, const Vec3& impulse);

}  // namespace duet
