// What joints add to a step around its solves (paper sections 4 to 7).
#include "sim/step/step.h"

namespace duet {

void begin_joints(World& world, StepContext& context) {
  const RigidBodies& rigid = world.bodies.rigid;
  context.joints.update(world.bodies.articulation, rigid);
  if (world.has(Effect::pd_control))
    context.joints.plan_control(world.bodies.articulation, rigid, context.time, context.dt);
  context.end_pose.resize(rigid.size());
  for (std::size_t i = 0; i < rigid.size(); ++i) context.end_pose[i] = rigid.state[i].pose;
  for (const KinematicStep& step : context.kinematic) context.end_pose[step.body] = step.end.pose;
}

// Push-out has moved bodies one by one; here they come together again. The velocities are v^^n and what the
// joints gave to make x^{n+1} fit: as in RATTLE (Andersen 1983) it belongs to v^{n+1} as well, and without it
// a pendulum loses energy in proportion to the step.
void finish_positions(World& world, StepContext& context) {
  RigidBodies& rigid = world.bodies.rigid;
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    if (!rigid.properties[i].is_dynamic()) continue;
    RigidState& state = rigid.state[i];
    state.velocity += rigid.properties[i].inverse_mass * context.joint_push[i];
    state.angular_momentum += context.joint_turn[i];
  }
  if (world.has(Effect::push_out)) context.joints.assemble(world.bodies.articulation, rigid);
  for (std::size_t i = 0; i < rigid.size(); ++i)
    update_orientation_dependents(rigid.state[i], rigid.properties[i]);
  context.joints.update(world.bodies.articulation, rigid);
  context.joints.stabilize(rigid);
}

}  // namespace duet
