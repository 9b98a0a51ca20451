// The beginning and the end of every step: the state of time n is stored, and the final state is completed.
#include "sim/step/step.h"

namespace duet {

void begin_step(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  follow_bodies(bodies.rigid, bodies.bound, bodies.particles);  // the state may have been put back, or loaded
  context.states.x_n = bodies.particles.x;
  context.states.rigid_n = bodies.rigid.state;
  if (world.has(Effect::kinematic_motion))
    take_velocities_after_jumps(context.time, world.settings.same_time(), bodies);
  store_velocities(bodies, context.states.v_n);
  // Later stages read v^^n even if the plan skips collisions.
  context.states.v_hat_n = context.states.v_n;
  choose_solved_bodies(world, context);
}

void plan_motion(World& world, StepContext& context) {
  evaluate_motions(world.bodies.rigid, context.time + context.dt, context.dt, world.settings.same_time(),
                   context.kinematic);
}

void end_step(World& world) {
  RigidBodies& rigid = world.bodies.rigid;
  for (std::size_t i = 0; i < rigid.size(); ++i)
    update_orientation_dependents(rigid.state[i], rigid.properties[i]);
  follow_bodies(rigid, world.bodies.bound, world.bodies.particles);
  check_finite(world, "V end");
}

void restore_step_start(World& world) {
  const StepContext& context = world.context;
  world.bodies.particles.x = context.states.x_n;
  world.bodies.particles.v = context.states.v_n.particle;
  world.bodies.rigid.state = context.states.rigid_n;
  for (RigidState& state : world.bodies.rigid.state) state.delay.setZero();
}

}  // namespace duet
