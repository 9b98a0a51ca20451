// What bones take up of the forces on their flesh in step V.
#include "sim/step/step.h"

namespace duet {

void bring_bound_to_middle(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  for (BoundParticle& bound : bodies.bound)
    bound.offset = bodies.particles.x[bound.at] - 0.5 * (context.rigid_n[bound.body].pose.position +
                                                         bodies.rigid.state[bound.body].pose.position);
}

// But for what an implicit solve left out of balance.
void apply_bound_forces(World& world, StepContext& context) {
  RigidBodies& rigid = world.bodies.rigid;
  if (world.bodies.bound.empty()) return;
  const bool implicit = world.settings.implicit_elasticity;
  const double share = !implicit || context.balanced ? 1 : 0.5;
  for (const BoundParticle& bound : world.bodies.bound)
    apply_impulse(rigid.state[bound.body], rigid.properties[bound.body], bound.offset,
                  share * context.dt * context.force[bound.particle]);
  for (std::size_t i = 0; implicit && i < rigid.size(); ++i) {
    const RigidProperties& properties = rigid.properties[i];
    if (!properties.is_dynamic()) continue;
    RigidState& state = rigid.state[i];
    state.velocity -= share * 2 * context.imbalance.linear[i];
    apply_angular_impulse(state, properties,
                          -share * 2 * (context.inertia[i] * context.imbalance.angular[i]));
  }
}

}  // namespace duet
