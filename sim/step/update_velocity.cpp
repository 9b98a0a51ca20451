// Step V: velocities (paper section 7).
#include "sim/coupling/pinching.h"
#include "sim/step/step.h"

namespace duet {

// V.2: V = v^n + dt/2 M^-1 (F(x^{n+1/2}) + F_damping(V)) with contact projected, which only serves to find
// the velocity at which V.3 evaluates the damping forces, unprojected: v^{n+1} = v^n + dt M^-1 (F(x^{n+1/2})
// + F_damping(V)). Together they are the trapezoidal rule for the damping.
void constrained_solve(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  ContactProjection* projection = nullptr;
  // Without elasticity there is nothing to solve, and rigid bodies take their velocities from V.3.
  if (world.has_internal_forces() || world.has(Effect::incompressibility)) {
    context.projection.build(bodies, context.contacts, context.graph, world.settings.projection_sweeps,
                             world.has(Effect::self_repulsion) ? &context.self_repulsion : nullptr,
                             link_active_contacts(world, context));
    if (world.has(Effect::articulation)) {
      context.joints.prepare_projection(bodies.rigid);
      context.projection.add_joints(context.joints);
    }
    projection = &context.projection;
  }

  context.x_next = particles.x;
  for (std::size_t p = 0; p < particles.size(); ++p)
    particles.x[p] = 0.5 * (context.x_n[p] + context.x_next[p]);
  carry(context.kinematic, context.x_n, context.dt, bodies);
  bring_bound_to_middle(world, context);
  solve_velocity(world, context, context.dt / 2, projection, true);

  for (std::size_t p = 0; p < particles.size(); ++p)
    particles.v[p] += context.dt * particles.inverse_mass[p] * context.force[p];
  // What an implicit solve left out of balance is no force, and stiff elements would make a great one of it.
  // Where it was much, the step ends at V, the velocity of its middle, instead of as far beyond.
  if (world.settings.implicit_elasticity && world.has_internal_forces()) {
    const double share = context.balanced ? 1 : 0.5;
    for (std::size_t p = 0; p < particles.size(); ++p) {
      const Vec3 change = particles.v[p] - context.v_hat_n.particle[p] - 2 * context.imbalance.particle[p];
      particles.v[p] = context.v_hat_n.particle[p] + share * change;
    }
  }
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_dynamic()) bodies.rigid.state[i].velocity += context.dt * world.gravity;
  apply_bound_forces(world, context);
  for (const KinematicStep& step : context.kinematic) {
    bodies.rigid.state[step.body].velocity = step.end.velocity;
    bodies.rigid.state[step.body].angular_velocity = step.end.angular_velocity;
  }
  end_carrying(context.kinematic, bodies);
  std::swap(particles.x, context.x_next);
  check_finite(world, "V.2 constrained solve");
}

namespace {

// The contacts that step III looked at, at x^{n+1}.
void prepare_again(World& world, StepContext& context) {
  update_contacts(context.graph, world.bodies, context.contacts);
  yield_where_pinched(world.bodies, context.dt, context.contacts, nullptr);
  predict_contacts(context.dt, world.settings.orientation, context.graph, world.bodies, context.contacts);
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
