// Step V.2 to V.4: velocities (paper section 7).
#include "sim/contact/detection/impact_plane.h"
#include "sim/contact/push_out/pinching.h"
#include "sim/step/step.h"

namespace duet {

void project_active_contacts(World& world, StepContext& context, const StickingBodies& sticking) {
  context.projection.build(world.bodies, context.contacts, context.graph, world.settings.projection_sweeps,
                           world.has(Effect::self_repulsion) ? &context.self_repulsion : nullptr,
                           link_active_contacts(world, context), sticking);
  if (!world.has(Effect::articulation)) return;
  context.joints.prepare_projection(world.bodies.rigid);
  context.projection.add_joints(context.joints);
}

bool solves_at_end(const World& world) {
  return !(world.settings.implicit_elasticity && world.has_internal_forces());
}

void find_solve_constraints(World& world, StepContext& context) { project_active_contacts(world, context); }

void find_explicit_forces(World& world, StepContext& context) {
  const Particles& particles = world.bodies.particles;
  context.force.resize(particles.size());
  for (std::size_t p = 0; p < particles.size(); ++p) context.force[p] = particles.mass[p] * world.gravity;
  if (world.has_internal_forces())
    world.clock.time(Stage::elastic_forces,
                     [&] { world.bodies.forces.add_elastic_forces(particles.x, context.force); });
  if (solves_contact(world)) context.explicit_force = context.force;
}

void add_turn_forces(World& world, StepContext& context, double at, std::vector<Vec3>& force) {
  if (!world.has_internal_forces()) return;
  const double seconds = (at - 0.5) * context.dt;
  world.clock.time(Stage::elastic_forces,
                   [&] { world.bodies.forces.add_turn_forces(context.mean_velocity, seconds, force); });
}

void find_middle_forces(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  const std::vector<Vec3>& x = bodies.particles.x;
  if (solves_contact(world)) to_generalized(bodies, context.start_velocity);
  context.x_half.resize(x.size());
  context.mean_velocity.resize(x.size());
  for (std::size_t p = 0; p < x.size(); ++p) {
    context.x_half[p] = 0.5 * (context.x_n[p] + x[p]);
    context.mean_velocity[p] = (x[p] - context.x_n[p]) / context.dt;
  }
  carry(context.kinematic, context.x_n, context.dt, bodies);
  const AtMiddle at_middle(world);
  bring_bound_to_middle(bodies, context.rigid_n);
  if (world.has(Effect::springs) && !world.settings.implicit_elasticity)
    bodies.forces.choose_altitudes(bodies.particles.x);
  find_explicit_forces(world, context);
  if (solves_at_end(world) && !world.settings.constraints_before_solve)
    add_turn_forces(world, context, world.settings.damping_at, context.force);
}

// V serves only to find the velocity at which V.3 evaluates the damping forces. With V at half of the step
// V.2 and V.3 together are the trapezoidal rule for the damping: a motion that damping would stop many times
// over within the step is reversed by it, and leaves and strikes what it touches again. With V at three
// quarters at most a third of such a motion is reversed.
void constrained_solve(World& world, StepContext& context) {
  const AtMiddle at_middle(world);
  // v-^n has the applied forces of the whole step.
  const double seconds = world.settings.damping_at * context.dt;
  solve_velocity(world, context, seconds, {&context.joint_drive, seconds - context.dt}, &context.projection,
                 SolveOf::update_velocity);
}

// v_**^{n+1} = v-^n + dt M^-1 (F + F_damping(V)) without P, as in the paper's section 7.2: the projections of
// V.2 only determine the velocity V of the damping. In the order in which constraints come before the solve,
// context.force holds the explicit forces only.
void evaluate_again(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p)
    particles.v[p] += context.dt * particles.inverse_mass[p] * context.force[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_dynamic()) bodies.rigid.state[i].velocity += context.dt * world.gravity;
  apply_bound_forces(bodies, context.force, context.dt);
  for (const KinematicStep& step : context.kinematic) {
    bodies.rigid.state[step.body].velocity = step.end.velocity;
    bodies.rigid.state[step.body].angular_velocity = step.end.angular_velocity;
  }
  end_carrying(context.kinematic, bodies);
  if (world.settings.constraints_before_solve && keeps_spin(world)) count_middle_forces(world, context, 1);
  check_finite(world, Stage::re_evaluation);
}

// The contacts are those of step III; no others are sought at x^{n+1}.
void prepare_contacts_at_end(World& world, StepContext& context) {
  update_contacts(context.graph, world.bodies, context.contacts);
  find_impact_planes(world.bodies, context.v_hat_n, context.dt, world.settings.orientation,
                     world.gravity.norm() * context.dt * context.dt, context.contacts);
  yield_where_pinched(world.bodies, context.dt, context.contacts, nullptr);
  find_speculative_targets(context.dt, world.settings.orientation, context.graph, world.bodies,
                           context.contacts, PredictionFor::velocity_at_end,
                           world.settings.collision.rigid_pairs ? &context.difference : nullptr);
  if (solves_contact(world)) context.contact_forces.restore_targets(context.contacts);
  act_at_start(context.first_frames, context.graph, world.bodies, context.contacts);
  // The solve starts from twice the impulses of step III, which dealt with the forces of half a step.
  warm_start_again(2, context.graph, world.bodies, context.contacts);
}

void control_joints_at_end(World& world, StepContext& context) {
  control_joints(world, context, ContactSolve::at_end);
}

void apply_contact_at_end(World& world, StepContext& context) {
  solve_contacts(world, context, ContactSolve::at_end);
  world.counters.contacts = count_active(context.contacts, context.graph);
}

}  // namespace duet
