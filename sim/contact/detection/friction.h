// Impulses with Coulomb friction: sticking is tried first, then sliding (Guendelman, Bridson, Fedkiw 2003).
#pragma once

#include "sim/base/types.h"

namespace duet {

/// Linear response of the relative velocity at a contact to an impulse there. All is in world axes.
struct ContactResponse {
  Mat3 K = Mat3::Zero();   ///< 1/kg: change of the relative velocity per impulse on the guest.
  double normal_mass = 0;  ///< kg: 1 / (n . K n), normal impulse per change of the normal velocity.
  /// kg: tangential impulse per tangential velocity that it alone is to stop.
  Mat3 sticking = Mat3::Zero();

  /// Makes the response of a contact that nothing can move.
  ContactResponse() = default;
  /// Computes the response for the matrix `K` (1/kg) and the unit normal `normal`. `K` has to be symmetric
  /// and positive definite.
  ContactResponse(const Mat3& K, const Vec3& normal);
};

/// Properties of a contact that friction_impulse() needs.
struct FrictionContact {
  Vec3 normal;               ///< Unit: from host to guest.
  ContactResponse response;  ///< Change of the relative velocity by impulses.
  double friction;           ///< Coulomb coefficient.
};

/// Returns the impulse (N s, on the guest) after which the normal relative velocity is `target` (m/s), where
/// `velocity` (m/s) is the relative velocity before it.
///
/// The result is zero if the bodies separate at least that fast already. Sticking removes all tangential
/// velocity. If that needs a tangential impulse greater than friction times the normal impulse, the bodies
/// slide instead. If friction is so large on an eccentric contact that sliding has no solution, the impulse
/// is normal. (Guendelman, Bridson, Fedkiw 2003)
Vec3 friction_impulse(const FrictionContact& contact, const Vec3& velocity, double target);

/// s j with s = -2 (j . v) / (j . K j), clamped to [0, 1]: the largest part of `impulse` (j, N s) that does
/// not add kinetic energy. `velocity` (v, m/s) is the relative velocity before it. The result is zero if
/// j . K j is.
Vec3 limit_energy(const Mat3& K, const Vec3& velocity, const Vec3& impulse);

}  // namespace duet
