// The damping of step V in the order in which constraints come before the solve (paper section 7.2). Contact
// and friction have seen the explicit forces, and damping acts on the velocities that they leave. The
// projection inside the conjugate gradients keeps the normal velocities of the contacts.
#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Solves v^{n+1} = v + dt P M^-1 F_damping(v^{n+1}), and leaves the damping forces (N) of the solution in
// context.solve.force.
void find_damping(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  to_generalized(bodies, context.solve.right_side);
  context.solve.solution = context.solve.right_side;
  context.solve.force.assign(bodies.particles.size(), Vec3::Zero());
  solve_with_damping(world, context, context.dt, &context.solve.projection, AssembleBlocks::all);
}

// Adds dt P M^-1 F to the velocities, with the forces F in context.solve.force. Forces and impulses of
// contact keep momentum to rounding however far the solve has converged.
void take_damping(Bodies& bodies, StepContext& context) {
  VelocitySolve& solve = context.solve;
  Particles& particles = bodies.particles;
  GeneralizedVelocity& change = solve.correction;
  change.particle.resize(particles.size());
  change.linear.assign(bodies.rigid.size(), Vec3::Zero());
  change.angular.assign(bodies.rigid.size(), Vec3::Zero());
  for (std::size_t p = 0; p < particles.size(); ++p)
    change.particle[p] = context.dt * particles.inverse_mass[p] * solve.force[p];
  add_force_twists(bodies.rigid, bodies.bound, solve.force, context.dt, change.linear, change.angular);
  follow_twists(bodies.bound, change.linear, change.angular, change.particle);
  solve.projection.project(change);
  for (std::size_t p = 0; p < particles.size(); ++p)
    if (particles.inverse_mass[p] > 0) particles.v[p] += change.particle[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const RigidProperties& properties = bodies.rigid.properties[i];
    if (!properties.is_dynamic()) continue;
    RigidState& state = bodies.rigid.state[i];
    state.velocity += change.linear[i];
    apply_angular_impulse(state, properties, solve.inertia[i] * change.angular[i]);
  }
}

}  // namespace

// v^{n+1} = v + dt P M^-1 F_damping(v^{n+1}), which is backward Euler for the damping of the elements at
// x^{n+1}, where contact acts. The trapezoidal rule would leave half of the motion that contact has excited.
void damp_at_end(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  project_active_contacts(world, context);
  if (world.has(Effect::self_repulsion))
    context.surfaces.repulsion.activate_rows(context.dt, 1, particles.v, particles.v);
  follow_bodies(bodies.rigid, bodies.bound, particles);
  if (!world.has_internal_forces()) return;

  context.solve.damping_force.assign(particles.size(), Vec3::Zero());
  world.clock.time(Stage::elastic_forces,
                   [&] { bodies.forces.add_elastic_forces(particles.x, context.solve.damping_force); });
  world.clock.time(Stage::damping_solve, [&] { find_damping(world, context); });
  take_damping(bodies, context);
  check_finite(world, Stage::damping_at_end);
}

}  // namespace duet
