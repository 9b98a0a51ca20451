// Particles that dynamic bodies carry (hard bindings), as bones carry flesh: their forces act on the bodies.
#include "sim/step/step.h"

namespace duet {

void bring_bound_to_middle(Bodies& bodies, const std::vector<RigidState>& rigid_n) {
  for (EmbeddedParticle& bound : bodies.bound)
    bound.offset = bodies.particles.x[bound.at] -
                   0.5 * (rigid_n[bound.body].pose.position + bodies.rigid.state[bound.body].pose.position);
}

void apply_bound_forces(Bodies& bodies, const std::vector<Vec3>& force, double dt) {
  RigidBodies& rigid = bodies.rigid;
  for (const EmbeddedParticle& bound : bodies.bound)
    apply_impulse(rigid.state[bound.body], rigid.properties[bound.body], bound.offset,
                  dt * force[bound.particle]);
}

void follow_bones(World& world, StepContext&) {
  follow_bodies(world.bodies.rigid, world.bodies.bound, world.bodies.particles);
}

}  // namespace duet
