// Particles that are bound to dynamic rigid bodies (hard bindings: Sifakis, Shinar, Irving, Fedkiw 2007): the
// flesh around a bone. They have no state and no mass of their own: they stand and move with the body, and
// what acts on them acts on it.
#pragma once

#include <vector>

#include "sim/deformable/particles.h"
#include "sim/rigid/rigid_bodies.h"

namespace duet {

struct BoundParticle {
  std::size_t particle = 0, body = 0;
  std::size_t at = 0;  // the particle whose place forces act at: its own, or the one that is tethered to it
  Vec3 arm = Vec3::Zero();     // m, in body space
  Vec3 offset = Vec3::Zero();  // m, in the world, from the centre of mass, where forces act now
};

// Binds particle p, whose mass becomes the body's: its inertia grows in proportion. The body's angular
// velocity stays.
BoundParticle bind_particle(std::size_t p, std::size_t body, RigidBodies& rigid, Particles& particles);

// Places the particles and gives them their velocities; offsets are those of the poses now.
void follow_bodies(const RigidBodies& rigid, std::vector<BoundParticle>& bound, Particles& particles);
// The velocities that twists (m/s and rad/s of all bodies) give the particles at their offsets.
void follow_twists(const std::vector<BoundParticle>& bound, const std::vector<Vec3>& linear,
                   const std::vector<Vec3>& angular, std::vector<Vec3>& velocity);
// Adds `scale` times the change of twists by the forces on the particles: M^-1 (f, r x f).
void add_force_twists(const RigidBodies& rigid, const std::vector<BoundParticle>& bound,
                      const std::vector<Vec3>& force, double scale, std::vector<Vec3>& linear,
                      std::vector<Vec3>& angular);

// For the bound of the time step: as if the body consisted of equal masses at its bound particles and some
// rest. The largest such mass, kg.
double equivalent_mass(const RigidProperties& body, const std::vector<BoundParticle>& bound,
                       std::size_t number);

}  // namespace duet
