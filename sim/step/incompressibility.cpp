// Steps I.2 and V.1: incompressible bodies (paper sections 3 and 7), and both again after the contacts of III
// and V.4, which the paper has not.
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

// Finds the pressures that change the rates of the one-rings by context.pressure.rate, and what they do to
// velocities.
void find_change(World& world, StepContext& context, const PressureSettings& settings) {
  const ContactProjection& projection = context.projection;
  PressureScratch& scratch = context.pressure;
  const CgResult result =
      find_pressures(world.bodies, projection.empty() ? nullptr : &projection, context.dt, settings, scratch);
  world.counters.pressure_iterations += result.iterations;
  const double share = bounded_share(world.bodies.one_rings, scratch.change.particle, context.dt);
  if (share < 1) scale(share, scratch);
}

void change_velocities(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  const PressureScratch& scratch = context.pressure;
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    bodies.particles.v[p] += scratch.change.particle[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const RigidProperties& properties = bodies.rigid.properties[i];
    if (context.projection.empty() || !properties.is_dynamic()) continue;
    RigidState& state = bodies.rigid.state[i];
    state.velocity += scratch.change.linear[i];
    const Mat3 rotation = state.pose.orientation.toRotationMatrix();
    const Vec3 body_rate = rotation.transpose() * scratch.change.angular[i];
    apply_angular_impulse(state, properties, rotation * properties.inertia.cwiseProduct(body_rate));
  }
}

// The rates that take the particles to where one-rings have their volumes at rest, between the bodies that
// context.projection keeps together.
void find_rates_to_rest_volumes(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  OneRings& rings = bodies.one_rings;
  rings.linearize(bodies.particles.x);
  std::vector<double>& rate = context.pressure.rate;
  rings.divergence(velocities_in_contact(bodies, context), rate);
  for (std::size_t i = 0; i < rings.size(); ++i) {
    // Flattened one-rings have less of a surface to push on: the way of their particles stays bounded.
    const double surface = std::min(1.0, std::sqrt(rings.diagonal(i) / rings.rest_diagonal(i)));
    const double most = surface * most_correction * rings.rest_volume(i);
    rate[i] = std::clamp(rings.rest_volume(i) - rings.volume(i), -most, most) / context.dt - rate[i];
  }
}

// Marks the incompressible bodies whose one-rings are to change by no more in a step than some times what a
// fall of a step makes of their size, dt^2 g / l. Returns whether all do.
bool find_resting(const World& world, StepContext& context) {
  constexpr double most_falls = 5;
  const OneRings& rings = world.bodies.one_rings;
  const std::vector<DeformableBody>& bodies = world.bodies.deformable;
  const double fall = most_falls * context.dt * world.gravity.norm();  // m/s
  context.rests.assign(bodies.size(), false);
  bool all = true;
  std::size_t d = 0, last = bodies.size();  // one-rings follow their bodies
  for (std::size_t i = 0; i < rings.size(); ++i) {
    while (rings.particle(i) >= bodies[d].first_particle + bodies[d].particle_count) ++d;
    if (d != last) context.rests[d] = true;
    last = d;
    const double size = math::cbrt(rings.rest_volume(i));
    if (std::abs(context.pressure.rate[i]) <= fall * size * size) continue;
    context.rests[d] = all = false;
  }
  return all;
}

// Makes context.projection that of the contacts of this step, for rates that `find_rates` finds. Where a body
// rests, friction holds what sticks: pressures that let it slide made a box creep down a slope by 1.5 mm/s.
// Where one lands or is crushed it does not: contact that can neither slide nor part in a solve goes on and
// off from step to step, and feeds energy in. Whether there is any contact.
template <class FindRates>
bool project_contacts(World& world, StepContext& context, FindRates&& find_rates) {
  context.pressure.rate.assign(world.bodies.one_rings.size(), 0.0);
  find_resting(world, context);
  project_active_contacts(world, context, context.rests);
  if (context.projection.empty()) return false;
  find_rates();
  if (find_resting(world, context)) return true;
  project_active_contacts(world, context, context.rests);
  find_rates();
  return true;
}

// Of what changes velocities for good.
PressureSettings velocity_settings(const World& world) {
  PressureSettings settings = world.settings.pressure;
  settings.tolerance *= velocity_reduction;
  settings.reduction = velocity_reduction;
  return settings;
}

}  // namespace

// I.2. The contacts of this step are not known yet: pressures take account of those of the last one.
void correct_volume(World& world, StepContext& context) {
  context.projection.build(world.bodies, context.memory, context.dt, world.settings.projection_sweeps);
  find_rates_to_rest_volumes(world, context);
  find_change(world, context, world.settings.pressure);
  change_velocities(world, context);
  check_finite(world, Stage::volume_correction);
}

bool keeps_volume_in_contact(const World& world) { return !world.settings.implicit_elasticity; }

// Contact's impulses of III change volumes once more: they take the place of those of the last step, and rub.
// What that leaves would be made good by the next step against the pressure, p dV, where nothing took that
// energy from the body as it was compressed: a box that lands on rough ground gained three times its energy.
void correct_volume_in_contact(World& world, StepContext& context) {
  if (!project_contacts(world, context, [&] { find_rates_to_rest_volumes(world, context); })) return;
  find_change(world, context, world.settings.pressure);
  change_velocities(world, context);
  check_finite(world, Stage::volume_in_contact);
}

// V.1. The paper and its program take the divergence at x^{n+1/2} out of v^n, before the forces of the step.
// That leaves the pressures' answer to these forces out of v^{n+1}, and costs a turning body a part (w
// dt)^2/4 of its angular momentum in every step: v^n is no rotation of x^{n+1/2}. Here the pressures act
// where the other forces do, at x^{n+1/2}, but after them, and so that v^{n+1} is without divergence where it
// belongs, at x^{n+1}: the part that is lost is of the next order.
void make_incompressible(World& world, StepContext& context) {
  const bool after_contact = world.settings.constraints_first && keeps_spin(world);
  if (after_contact) count_middle_forces(world, context, -1);
  Bodies& bodies = world.bodies;
  OneRings& rings = bodies.one_rings;
  std::vector<double>& rate = context.pressure.rate;
  rings.divergence_at(bodies.particles.x, velocities_in_contact(bodies, context), rate);
  for (double& r : rate) r = -r;
  rings.linearize(context.x_half);
  find_change(world, context, velocity_settings(world));
  change_velocities(world, context);
  for (std::size_t i = 0; i < context.held_pressure.size(); ++i)
    context.new_pressure[i] = context.pressure.pressure[i] / context.dt;
  if (after_contact) count_middle_forces(world, context, 1);
  check_finite(world, Stage::make_incompressible);
}

// As correct_volume_in_contact(), of velocities and the contacts of V.4.
void keep_volume(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  OneRings& rings = bodies.one_rings;
  rings.linearize(bodies.particles.x);
  const auto find_rates = [&] {
    std::vector<double>& rate = context.pressure.rate;
    rings.divergence(velocities_in_contact(bodies, context), rate);
    for (double& r : rate) r = -r;
  };
  if (!project_contacts(world, context, find_rates)) return;
  find_change(world, context, velocity_settings(world));
  change_velocities(world, context);
  for (std::size_t i = 0; i < context.held_pressure.size(); ++i)
    context.new_pressure[i] += context.pressure.pressure[i] / context.dt;
  check_finite(world, Stage::volume_at_end);
}

// Damping is that of the velocities that pressures leave. Without them, in a body that is compressed, it
// would be that of particles that the elastic forces drive apart, and do work on those that stay together.
void add_held_pressures(World& world, StepContext& context, double dt, std::vector<Vec3>& velocity) {
  OneRings& rings = world.bodies.one_rings;
  PressureScratch& scratch = context.pressure;
  scratch.scaled.resize(rings.size());
  for (std::size_t i = 0; i < rings.size(); ++i) scratch.scaled[i] = dt * context.held_pressure[i];
  scratch.change.particle.assign(world.bodies.particles.size(), Vec3::Zero());
  rings.linearize(world.bodies.particles.x);
  rings.pressure_velocity(scratch.scaled, scratch.change.particle);
  for (std::size_t p = 0; p < velocity.size(); ++p) velocity[p] += scratch.change.particle[p];
}

}  // namespace duet
