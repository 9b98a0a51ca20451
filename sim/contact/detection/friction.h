// Impulses with Coulomb friction: sticking is tried first, then sliding (Guendelman, Bridson, Fedkiw 2003).
#pragma once

#include "sim/base/types.h"

namespace duet {

/// Linear response of the relative velocity at a contact to an impulse there. All is in world axes.
class ContactResponse {
 public:
  Mat3 K = Mat3::Zero();   ///< 1/kg: change of the relative velocity per impulse on the guest.
  double normal_mass = 0;  ///< kg: 1 / (n . K n), normal impulse per change of the normal velocity.

  /// Makes the response of a contact that nothing can move.
  ContactResponse() = default;
  /// Computes the response for the matrix K = `factor` (1/kg), which has to be symmetric and positive
  /// definite, and the unit normal `n`.
  ContactResponse(const Mat3& factor, const Vec3& n)
      : K(factor), normal_mass(1 / n.dot(factor * n)), normal_(n), knows_sticking_(false) {}

  /// Returns the tangential impulse per tangential velocity that it alone is to stop, kg.
  ///
  /// The first call computes it, because most contacts of a step exert nothing and never need it. So calls
  /// for one contact must not run at the same time.
  const Mat3& sticking() const {
    if (!knows_sticking_) find_sticking();
    return sticking_;
  }

 private:
  void find_sticking() const;

  Vec3 normal_ = Vec3::Zero();
  mutable bool knows_sticking_ = true;
  mutable Mat3 sticking_ = Mat3::Zero();
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
