// Step II: collisions (paper section 4).
#include "sim/contact/detection/impact_plane.h"
#include "sim/contact/push_out/pinching.h"
#include "sim/step/step.h"

namespace duet {

void find_contacts(World& world, StepContext& context) {
  velocity_difference(world.bodies, context.v_n, context.difference);
  find_candidates(world.bodies, world.contact_filter(), context.dt, context.difference, context.contacts);
  find_impact_planes(world.bodies, context.v_n, context.dt, world.settings.orientation,
                     world.gravity.norm() * context.dt * context.dt, context.contacts);
  context.contacts.pinches.clear();
  yield_where_pinched(world.bodies, context.dt, context.contacts, &context.contacts.pinches);
}

void return_to_start(World& world, StepContext& context) {
  if (!world.meets()) velocity_difference(world.bodies, context.v_n, context.difference);
  restore_velocities(context.v_n, world.bodies);
}

// Collisions on jointed bodies see the response of the whole group. The impulses of the joints are then taken
// back, because stabilize_collided() solves for them and counts them.
void collide(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  ArticulatedResponse* articulated_response =
      world.has(Effect::articulation)
          ? context.articulated_response.prepare(bodies, context.joints, ControlledJoints::are_free,
                                                 context.contacts)
          : nullptr;
  if (articulated_response) articulated_response->begin(bodies.rigid);
  process_collisions(bodies, context.difference, context.dt, world.settings.collision, articulated_response,
                     context.contacts, context.collision_scratch);
  if (!articulated_response) return;
  articulated_response->finish(bodies.rigid);
  articulated_response->release(context.contacts);
}

void stabilize_collided(World& world, StepContext& context) { context.joints.stabilize(world.bodies.rigid); }

void evolve_again(World& world, StepContext& context) {
  store_velocities(world.bodies, context.v_hat_n);
  add_velocities(context.difference, world.bodies);
}

}  // namespace duet
