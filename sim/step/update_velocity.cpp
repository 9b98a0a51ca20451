// Step V.2 to V.4: velocities (paper section 7).
#include "sim/contact/detection/impact_plane.h"
#include "sim/contact/push_out/held_places.h"
#include "sim/contact/push_out/pinching.h"
#include "sim/step/step.h"

namespace duet {

void project_active_contacts(World& world, StepContext& context, const StickingBodies& sticking) {
  context.solve.projection.build(world.bodies, context.contact.contacts, context.contact.graph,
                                 world.settings.projection_sweeps,
                                 world.has(Effect::self_repulsion) ? &context.surfaces.repulsion : nullptr,
                                 link_active_contacts(world, context), sticking);
  if (!world.has(Effect::articulation)) return;
  context.joints.solver.prepare_projection(world.bodies.rigid);
  context.solve.projection.add_joints(context.joints.solver);
}

bool solves_at_end(const World& world) {
  return !(world.settings.implicit_elasticity && world.has_internal_forces());
}

void find_solve_constraints(World& world, StepContext& context) { project_active_contacts(world, context); }

void find_explicit_forces(World& world, StepContext& context, const Turn* turn) {
  VelocitySolve& solve = context.solve;
  const Particles& particles = world.bodies.particles;
  solve.force.resize(particles.size());
  for (std::size_t p = 0; p < particles.size(); ++p) solve.force[p] = particles.mass[p] * world.gravity;
  if (world.has_internal_forces())
    world.clock.time(Stage::elastic_forces,
                     [&] { world.bodies.forces.add_elastic_forces(particles.x, solve.force, turn); });
  if (solves_contact(world)) solve.explicit_force = solve.force;
}

void add_turn_forces(World& world, StepContext& context, double at, std::vector<Vec3>& force) {
  if (!world.has_internal_forces()) return;
  const double seconds = (at - 0.5) * context.dt;
  world.clock.time(Stage::elastic_forces,
                   [&] { world.bodies.forces.add_turn_forces(context.solve.mean_velocity, seconds, force); });
}

void find_middle_forces(World& world, StepContext& context) {
  PaperStates& states = context.states;
  Bodies& bodies = world.bodies;
  const std::vector<Vec3>& x = bodies.particles.x;
  if (solves_contact(world)) to_generalized(bodies, context.solved.start_velocity);
  states.x_half.resize(x.size());
  context.solve.mean_velocity.resize(x.size());
  for (std::size_t p = 0; p < x.size(); ++p) {
    states.x_half[p] = 0.5 * (states.x_n[p] + x[p]);
    context.solve.mean_velocity[p] = (x[p] - states.x_n[p]) / context.dt;
  }
  carry(context.kinematic, states.x_n, context.dt, bodies);
  const AtMiddle at_middle(world);
  bring_bound_to_middle(bodies, states.rigid_n);
  if (world.has(Effect::springs) && !world.settings.implicit_elasticity)
    bodies.forces.choose_altitudes(bodies.particles.x);
  const bool turns =
      world.has_internal_forces() && solves_at_end(world) && !world.settings.constraints_before_solve;
  const Turn turn{context.solve.mean_velocity, (world.settings.damping_at - 0.5) * context.dt};
  find_explicit_forces(world, context, turns ? &turn : nullptr);
  if (turns)
    world.clock.time(Stage::elastic_forces,
                     [&] { bodies.forces.add_kept_turn_forces(turn, context.solve.force); });
}

// V serves only to find the velocity at which V.3 evaluates the damping forces. With V at half of the step
// V.2 and V.3 together are the trapezoidal rule for the damping: a motion that damping would stop many times
// over within the step is reversed by it, and leaves and strikes what it touches again. With V at three
// quarters at most a third of such a motion is reversed.
void constrained_solve(World& world, StepContext& context) {
  const AtMiddle at_middle(world);
  // v-^n has the applied forces of the whole step.
  const double seconds = world.settings.damping_at * context.dt;
  solve_velocity(world, context, seconds, {&context.joints.drive, seconds - context.dt},
                 &context.solve.projection, SolveOf::update_velocity);
}

// v_**^{n+1} = v-^n + dt M^-1 (F + F_damping(V)) without P, as in the paper's section 7.2: the projections of
// V.2 only determine the velocity V of the damping. In the order in which constraints come before the solve,
// context.solve.force holds the explicit forces only.
void evaluate_again(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p)
    particles.v[p] += context.dt * particles.inverse_mass[p] * context.solve.force[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_dynamic()) bodies.rigid.state[i].velocity += context.dt * world.gravity;
  apply_bound_forces(bodies, context.solve.force, context.dt);
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
  ContactStage& contact = context.contact;
  update_contacts(contact.graph, world.bodies, contact.contacts, [&](const ContactPair& pair) {
    return solves_contact(world) && is_solved(context, world.bodies, pair);
  });
  find_impact_planes(world.bodies, context.states.v_hat_n, context.dt, world.settings.orientation,
                     world.gravity.norm() * context.dt * context.dt, contact.contacts);
  yield_where_pinched(world.bodies, context.dt, contact.contacts, nullptr);
  yield_where_held(world.bodies, contact.contacts);
  find_speculative_targets(context.dt, world.settings.orientation, contact.graph, world.bodies,
                           contact.contacts, PredictionFor::velocity_at_end,
                           world.settings.collision.rigid_pairs ? &context.states.difference : nullptr);
  if (solves_contact(world)) context.solved.forces.restore_targets(contact.contacts);
  act_at_start(contact.first_frames, contact.graph, world.bodies, contact.contacts);
  // The solve starts from twice the impulses of step III, which dealt with the forces of half a step.
  warm_start_again(2, contact.graph, world.bodies, contact.contacts);
}

void control_joints_at_end(World& world, StepContext& context) {
  control_joints(world, context, ContactSolve::at_end);
}

void apply_contact_at_end(World& world, StepContext& context) {
  solve_contacts(world, context, ContactSolve::at_end);
  world.counters.contacts = count_active(context.contact.contacts, context.contact.graph);
}

}  // namespace duet
