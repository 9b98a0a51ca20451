// Energy and time step of worlds with elastic bodies.
#pragma once

#include <cmath>

#include "sim/step/world.h"

namespace duet::test {

// Returns the sum of kinetic and elastic energy (J). Potential energy is left out.
inline double mechanical_energy(const World& world) {
  return kinetic_energy(world.bodies) + world.bodies.forces.energy(world.bodies.particles.x);
}

// Returns the time step (s) that the rule for elastic forces chooses at rest, if nothing else bounds it: cfl
// * 2 / omega.
inline double rule_step(const World& world) {
  return world.settings.cfl * 2 / std::sqrt(world.bodies.forces.rest_omega_squared());
}

}  // namespace duet::test
