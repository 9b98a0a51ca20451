// Hard bindings: particles of flesh that dynamic rigid bodies (bones) carry (Sifakis, Shinar, Irving, Fedkiw
// 2007). They have no state and no mass of their own: the body carries their mass at their places, they move
// with the body, and forces on them act on the body.
#pragma once

#include <vector>

#include "sim/deformable/particles.h"
#include "sim/rigid/rigid_bodies.h"

namespace duet {

/// A particle that a dynamic rigid body carries.
struct EmbeddedParticle {
  std::size_t particle = 0,  ///< index of the particle
      body = 0;              ///< index of the rigid body
  /// index of the particle at whose position forces act: the bound particle itself, or the one that a
  /// zero-length spring connects to it
  std::size_t at = 0;
  double mass = 0;             ///< kg, mass of the particle, which the body carries
  Vec3 arm = Vec3::Zero();     ///< m, position of the particle in body space
  Vec3 offset = Vec3::Zero();  ///< m, in the world, from the center of mass to where forces act now
};

/// Binds particle `p` to a dynamic body at its present place.
///
/// The particle's mass and inverse mass become 0; the body gets the mass from take_over_masses(). Forces act
/// at the particle itself (`at` is `p`).
EmbeddedParticle embed_particle(std::size_t p, std::size_t body, const RigidBodies& rigid,
                                Particles& particles);

/// Gives the bodies the masses m_i of their bound particles, which are at r_i in body space:
///
///     M = m + sum m_i,   c = sum m_i r_i / M,
///     I_c = I + m (c.c 1 - c c^T) + sum m_i (d_i.d_i 1 - d_i d_i^T),   d_i = r_i - c
///
/// These are mass, center of mass and inertia of body and particles together, by the parallel axis theorem.
/// If the center of mass or the principal axes change by more than rounding, body space moves there, see
/// RigidProperties::shape_frame: shape, particles and their velocities stay in the world. Must be called
/// once, after all particles are bound. Bodies whose particles have no mass stay as they are.
void take_over_masses(RigidBodies& rigid, std::vector<EmbeddedParticle>& bound, const Particles& particles);

/// Places the bound particles by the bodies' poses, gives them their velocities, and updates the offsets.
///
/// The velocity is that of the body at the place where forces act.
void follow_bodies(const RigidBodies& rigid, std::vector<EmbeddedParticle>& bound, Particles& particles);
/// Sets the velocities of the bound particles (m/s) that the bodies' twists cause at the particles' offsets.
///
///     v = linear + angular x offset
///
/// `linear` (m/s) and `angular` (rad/s) have one entry for each body, `velocity` one for each particle;
/// entries of other particles stay.
void follow_twists(const std::vector<EmbeddedParticle>& bound, const std::vector<Vec3>& linear,
                   const std::vector<Vec3>& angular, std::vector<Vec3>& velocity);
/// Adds `scale` times the change of the bodies' twists by the forces on the bound particles.
///
///     linear += scale f / m,   angular += scale I^-1 (offset x f)
///
/// `force` (N) has one entry for each particle, `linear` and `angular` one for each body. With `scale` in s
/// the changes are in m/s and rad/s.
void add_force_twists(const RigidBodies& rigid, const std::vector<EmbeddedParticle>& bound,
                      const std::vector<Vec3>& force, double scale, std::vector<Vec3>& linear,
                      std::vector<Vec3>& angular);

/// Returns the largest mass (kg) such that the body is at least as inert as equal masses of this size at its
/// bound particles.
///
/// It stands for the mass of a bound particle in the bound of the time step. `number` is the index of the
/// body, which must have a bound particle.
double equivalent_mass(const RigidProperties& body, const std::vector<EmbeddedParticle>& bound,
                       std::size_t number);

}  // namespace duet
