// Step V: velocities (paper section 7).
#include "sim/coupling/impact_plane.h"
#include "sim/coupling/pinching.h"
#include "sim/step/step.h"

namespace duet {

namespace {

// Those of gravity and elasticity at the positions now.
void find_forces(World& world, StepContext& context) {
  const Particles& particles = world.bodies.particles;
  context.force.resize(particles.size());
  for (std::size_t p = 0; p < particles.size(); ++p) context.force[p] = particles.mass[p] * world.gravity;
  world.clock.time(Stage::elastic_forces,
                   [&] { world.bodies.forces.add_elastic_forces(particles.x, context.force); });
  context.explicit_force = context.force;
}

}  // namespace

void project_active_contacts(World& world, StepContext& context, const std::vector<char>& rests) {
  context.projection.build(world.bodies, context.contacts, context.graph, world.settings.projection_sweeps,
                           world.has(Effect::self_repulsion) ? &context.self_repulsion : nullptr,
                           link_active_contacts(world, context), rests);
  if (!world.has(Effect::articulation)) return;
  context.joints.prepare_projection(world.bodies.rigid);
  context.projection.add_joints(context.joints);
}

// V.2: V = v^n + dt/2 M^-1 (F(x^{n+1/2}) + F_damping(V)) with contact projected, which only serves to find
// the velocity at which V.3 evaluates the damping forces, unprojected: v^{n+1} = v^n + dt M^-1 (F(x^{n+1/2})
// + F_damping(V)). Together they are the trapezoidal rule for the damping.
void constrained_solve(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  const bool is_implicit = world.settings.implicit_elasticity && world.has_internal_forces();
  begin_contact_at_end(world, context);
  context.solve_from_outside = {};
  ContactProjection* projection = nullptr;
  // Without elasticity there is nothing to solve, and rigid bodies take their velocities from V.3.
  if (!is_implicit && (world.has_internal_forces() || world.has(Effect::incompressibility))) {
    project_active_contacts(world, context);
    projection = &context.projection;
  }

  context.x_next = particles.x;
  for (std::size_t p = 0; p < particles.size(); ++p)
    particles.x[p] = 0.5 * (context.x_n[p] + context.x_next[p]);
  carry(context.kinematic, context.x_n, context.dt, bodies);
  bring_bound_to_middle(world, context);
  if (is_implicit)
    find_forces(world, context);
  else
    solve_velocity(world, context, context.dt / 2, projection, true);

  for (std::size_t p = 0; p < particles.size(); ++p)
    particles.v[p] += context.dt * particles.inverse_mass[p] * context.force[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_dynamic()) bodies.rigid.state[i].velocity += context.dt * world.gravity;
  apply_bound_forces(world, context);
  for (const KinematicStep& step : context.kinematic) {
    bodies.rigid.state[step.body].velocity = step.end.velocity;
    bodies.rigid.state[step.body].angular_velocity = step.end.angular_velocity;
  }
  end_carrying(context.kinematic, bodies);
  std::swap(particles.x, context.x_next);
  if (solves_contact(world)) solve_contact_at_end(world, context);
  check_finite(world, "V.2 constrained solve");
}

namespace {

// The contacts that step III looked at, at x^{n+1}.
void prepare_again(World& world, StepContext& context) {
  update_contacts(context.graph, world.bodies, context.contacts);
  find_impact_planes(world.bodies, context.v_hat_n, context.dt, world.settings.orientation,
                     world.gravity.norm() * context.dt * context.dt, context.contacts);
  yield_where_pinched(world.bodies, context.dt, context.contacts, nullptr);
  predict_contacts(context.dt, world.settings.orientation, context.graph, world.bodies, context.contacts,
                   PredictionFor::velocity_at_end);
  if (solves_contact(world)) context.contact_forces.restore_targets(context.contacts);
  // Step III dealt with the forces of half a step: twice its impulses is where the solve begins.
  warm_start_again(2, context.graph, world.bodies, context.contacts);
}

}  // namespace

// V.4: joints, their control, contact and friction as a post-process.
void apply_velocity_contact(World& world, StepContext& context) {
  if (world.touches()) prepare_again(world, context);
  solve_contacts(world, context, true);
  if (world.touches()) world.counters.contacts = count_active(context.contacts, context.graph);
}

}  // namespace duet
