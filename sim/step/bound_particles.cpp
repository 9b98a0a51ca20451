// What bones take up of the forces on their flesh in step V.
#include "sim/step/step.h"

namespace duet {

void bring_bound_to_middle(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  for (BoundParticle& bound : bodies.bound)
    bound.offset = bodies.particles.x[bound.at] - 0.5 * (context.rigid_n[bound.body].pose.position +
                                                         bodies.rigid.state[bound.body].pose.position);
}

void apply_bound_forces(World& world, StepContext& context) {
  RigidBodies& rigid = world.bodies.rigid;
  for (const BoundParticle& bound : world.bodies.bound)
    apply_impulse(rigid.state[bound.body], rigid.properties[bound.body], bound.offset,
                  context.dt * context.force[bound.particle]);
}

}  // namespace duet
