// How strongly the deformation of a body is damped.
#pragma once

#include "sim/scene/scene.h"
#include "sim/state/bodies.h"

namespace duet::scene {

/// The slowest deformation of a body, as a damped oscillator: u'' + tau w^2 u' + w^2 u = 0.
struct BodyDamping {
  double frequency = 0;  ///< w, rad/s; 0 if nothing resists deformation
  double time = 0;       ///< tau, s: the time in which strain relaxes, viscosity over stiffness
  /// Returns whether the damping is more than ten times critical, tau w > 20: the body creeps instead of
  /// oscillating. Contact of such bodies is solved within the velocity solves; up to three times this limit,
  /// contact outside of them does no harm.
  bool is_strong() const { return frequency * time > 20; }
};

/// Returns the damping of the last deformable body that was added to `bodies`.
///
/// Its slowest deformation is taken to be that of a bar of the body's largest extent L,
///
///     w = pi / L sqrt(E V / m)
///
/// with its volume V, mass m and modulus E. Springs have the stiffness E V and the viscosity tau E V of their
/// resistance to a uniform stretch along L: sums of k l^2 c^4 and of their viscosity times l^2 c^4, with
/// their length l and the cosine c of their angle to it.
BodyDamping damping_of_last(const DeformableBody& description, const Material& material,
                            const Bodies& bodies);

}  // namespace duet::scene
