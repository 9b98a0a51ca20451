// Step I: v^n -> v~^{n+1/2} (paper section 3), and the implicit solve that it shares with step V.
#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet {

void solve_velocity(World& world, StepContext& context, double dt, ContactProjection* projection) {
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  const bool elastic = world.has(Effect::deformable_elasticity);

  context.force.resize(particles.size());
  for (std::size_t p = 0; p < particles.size(); ++p) context.force[p] = particles.mass[p] * world.gravity;
  if (elastic)
    world.clock.time(Stage::elastic_forces,
                     [&] { bodies.forces.add_elastic_forces(particles.x, context.force); });

  // B = v + dt M^-1 (explicit forces); gyroscopic motion needs no force, as angular momentum is what rigid
  // bodies keep.
  to_generalized(bodies, context.right_side);
  for (std::size_t p = 0; p < particles.size(); ++p)
    context.right_side.particle[p] += dt * particles.inverse_mass[p] * context.force[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_dynamic()) context.right_side.linear[i] += dt * world.gravity;
  for (const KinematicStep& step : context.kinematic) {
    const RigidState& start = bodies.rigid.state[step.body];
    context.right_side.linear[step.body] = 0.5 * (start.velocity + step.end.velocity);
    context.right_side.angular[step.body] = 0.5 * (start.angular_velocity + step.end.angular_velocity);
  }

  context.solution = context.right_side;
  if (projection) {
    to_generalized(bodies, context.image);  // v_n, whose normal velocities the targets halve
    projection->satisfy(context.image, context.solution);
  }
  if (!elastic) return;
  world.clock.time(Stage::damping_solve, [&] {
    VelocitySystem system(bodies, dt, projection, context.damping_force, context.inertia);
    const CgResult result = conjugate_gradient(system, context.right_side, world.settings.cg_tolerance,
                                               world.settings.cg_iterations, context.solution,
                                               context.residual, context.direction, context.image);
    world.counters.cg_iterations += result.iterations;
  });
}

// I.1. The damping forces are linear in V, so whatever the tolerance of the solve leaves keeps momentum.
void advance_velocity(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  solve_velocity(world, context, context.dt / 2, nullptr);
  bodies.particles.v = context.solution.particle;
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    bodies.rigid.state[i].velocity = context.solution.linear[i];
  for (const KinematicStep& step : context.kinematic) {
    bodies.rigid.state[step.body].velocity = step.mean_velocity;
    bodies.rigid.state[step.body].angular_velocity = step.mean_angular_velocity;
  }
  check_finite(world, "I.1 advance velocity");
}

}  // namespace duet
