// Steps I.2 and V.1: incompressible bodies (paper sections 3 and 7).
#include <algorithm>
#include <cmath>

#include "sim/base/elementary.h"
#include "sim/base/parallel.h"
#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// The part of its rest volume that a one-ring may gain or lose back in one step: what a blow or a bad start
// has crushed is restored over several steps, each of which is short enough for its linearization.
constexpr double most_correction = 0.1;

// The part of its one-ring's size that pressures may move a particle in one step: what is tangled has volumes
// that small motions hardly change, and large ones in no foreseeable way.
constexpr double most_travel = 0.25;

// What the velocities of a step keep of the divergence that they would have without pressures. It has to be
// little of even a small divergence, as that of a slow rotation is: it would add up over the steps.
constexpr double velocity_reduction = 1e-2;

// The velocities now as contact will leave them: what touches moves on together.
const std::vector<Vec3>& velocities_in_contact(const Bodies& bodies, StepContext& context) {
  to_generalized(bodies, context.solution);
  context.projection.project(context.solution);
  return context.solution.particle;
}

// The part of the velocities `change` that moves no particle too far; 1 in all but wild states.
double bounded_share(const OneRings& rings, const std::vector<Vec3>& change, double dt) {
  return parallel_reduce(
      rings.size(), 1024, 1.0,
      [&](std::size_t begin, std::size_t end) {
        double share = 1;
        for (std::size_t i = begin; i < end; ++i) {
          const double way = dt * change[static_cast<std::size_t>(rings.particle(i))].norm();
          const double most = most_travel * math::cbrt(rings.rest_volume(i));
          if (way > most) share = std::min(share, most / way);
        }
        return share;
      },
      [](double a, double b) { return std::min(a, b); });
}

void scale(double share, PressureScratch& scratch) {
  for (double& q : scratch.pressure) q *= share;
  for (std::vector<Vec3>* values :
       {&scratch.change.particle, &scratch.change.linear, &scratch.change.angular})
    for (Vec3& value : *values) value *= share;
}

// Changes the velocities by the pressures that change the rates of the one-rings by context.pressure.rate.
void apply_pressures(World& world, StepContext& context, const PressureSettings& settings) {
  Bodies& bodies = world.bodies;
  const ContactProjection& projection = context.projection;
  PressureScratch& scratch = context.pressure;
  const CgResult result =
      find_pressures(bodies, projection.empty() ? nullptr : &projection, context.dt, settings, scratch);
  world.counters.pressure_iterations += result.iterations;
  const double share = bounded_share(bodies.one_rings, scratch.change.particle, context.dt);
  if (share < 1) scale(share, scratch);
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    bodies.particles.v[p] += scratch.change.particle[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const RigidProperties& properties = bodies.rigid.properties[i];
    if (projection.empty() || !properties.is_dynamic()) continue;
    RigidState& state = bodies.rigid.state[i];
    state.velocity += scratch.change.linear[i];
    const Mat3 rotation = state.pose.orientation.toRotationMatrix();
    const Vec3 body_rate = rotation.transpose() * scratch.change.angular[i];
    apply_angular_impulse(state, properties, rotation * properties.inertia.cwiseProduct(body_rate));
  }
}

}  // namespace

// I.2. The contacts of this step are not known yet: pressures take account of those of the last one.
void correct_volume(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  OneRings& rings = bodies.one_rings;
  rings.linearize(bodies.particles.x);
  context.projection.build(bodies, context.memory, context.dt, world.settings.projection_sweeps);
  std::vector<double>& rate = context.pressure.rate;
  rings.divergence(velocities_in_contact(bodies, context), rate);
  for (std::size_t i = 0; i < rings.size(); ++i) {
    // Flattened one-rings have less of a surface to push on: the way of their particles stays bounded.
    const double surface = std::min(1.0, std::sqrt(rings.diagonal(i) / rings.rest_diagonal(i)));
    const double most = surface * most_correction * rings.rest_volume(i);
    rate[i] = std::clamp(rings.rest_volume(i) - rings.volume(i), -most, most) / context.dt - rate[i];
  }
  apply_pressures(world, context, world.settings.pressure);
  check_finite(world, "I.2 volume correction");
}

// V.1. The paper and its program take the divergence at x^{n+1/2} out of v^n, before the forces of the step.
// That leaves the pressures' answer to these forces out of v^{n+1}, and costs a turning body a part (w
// dt)^2/4 of its angular momentum in every step: v^n is no rotation of x^{n+1/2}. Here the pressures act
// where the other forces do, at x^{n+1/2}, but after them, and so that v^{n+1} is without divergence where it
// belongs, at x^{n+1}: the part that is lost is of the next order.
void make_incompressible(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  OneRings& rings = bodies.one_rings;
  std::vector<double>& rate = context.pressure.rate;
  rings.divergence_at(bodies.particles.x, velocities_in_contact(bodies, context), rate);
  for (double& r : rate) r = -r;
  context.x_half.resize(bodies.particles.size());
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    context.x_half[p] = 0.5 * (context.x_n[p] + bodies.particles.x[p]);
  rings.linearize(context.x_half);
  PressureSettings settings = world.settings.pressure;
  settings.tolerance *= velocity_reduction;
  settings.reduction = velocity_reduction;
  apply_pressures(world, context, settings);
  check_finite(world, "V.1 make incompressible");
}

}  // namespace duet
