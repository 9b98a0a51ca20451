// What tests ask of a world of elastic bodies.
#pragma once

#include <cmath>

#include "sim/step/world.h"

namespace duet::test {

// J, kinetic and elastic.
inline double mechanical_energy(const World& world) {
  return kinetic_energy(world.bodies) + world.bodies.forces.energy(world.bodies.particles.x);
}

// s, the step that the rule chooses at rest, where nothing else bounds it.
inline double rule_step(const World& world) {
  return world.settings.cfl * 2 / std::sqrt(world.bodies.forces.rest_squared_frequency());
}

}  // namespace duet::test
