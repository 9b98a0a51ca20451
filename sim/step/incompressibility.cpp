// Steps I.2 and V.1: incompressible bodies (paper sections 3 and 7).
#include <algorithm>
#include <cmath>

#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// The part of its rest volume that a one-ring may gain or lose back in one step: what a blow or a bad start
// has crushed is restored over several steps, each of which is short enough for its linearization.
constexpr double most_correction = 0.1;

}  // namespace

void correct_volume(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  OneRings& rings = bodies.one_rings;
  rings.linearize(bodies.particles.x);
  std::vector<double>& rate = context.pressure.rate;
  rate.resize(rings.size());
  for (std::size_t i = 0; i < rings.size(); ++i) {
    // Flattened one-rings have less of a surface to push on: the way of their particles stays bounded.
    const double surface = std::min(1.0, std::sqrt(rings.diagonal(i) / rings.rest_diagonal(i)));
    const double most = surface * most_correction * rings.rest_volume(i);
    rate[i] = std::clamp(rings.rest_volume(i) - rings.volume(i), -most, most) / context.dt;
  }
  to_generalized(bodies, context.solution);
  world.counters.pressure_iterations +=
      reach_rates(bodies, nullptr, context.dt, world.settings.pressure, context.pressure, context.solution)
          .iterations;
  bodies.particles.v = context.solution.particle;
  check_finite(world, "I.2 volume correction");
}

void make_incompressible(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  OneRings& rings = bodies.one_rings;
  context.x_half.resize(bodies.particles.size());
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    context.x_half[p] = 0.5 * (context.x_n[p] + bodies.particles.x[p]);
  rings.linearize(context.x_half);
  context.pressure.rate.assign(rings.size(), 0);
  to_generalized(bodies, context.solution);
  world.counters.pressure_iterations +=
      reach_rates(bodies, nullptr, context.dt, world.settings.pressure, context.pressure, context.solution)
          .iterations;
  bodies.particles.v = context.solution.particle;
  check_finite(world, "V.1 make incompressible");
}

}  // namespace duet
