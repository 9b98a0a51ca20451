// Step II: collisions (paper section 4).
#include "sim/contact/detection/impact_plane.h"
#include "sim/contact/push_out/held_places.h"
#include "sim/contact/push_out/pinching.h"
#include "sim/step/step.h"

namespace duet {

void find_contacts(World& world, StepContext& context) {
  velocity_difference(world.bodies, context.states.v_n, context.states.difference);
  find_candidates(world.bodies, world.contact_filter(), context.dt, context.states.difference,
                  context.contact.contacts);
  find_impact_planes(world.bodies, context.states.v_n, context.dt, world.settings.orientation,
                     world.gravity.norm() * context.dt * context.dt, context.contact.contacts);
  context.contact.contacts.pinches.clear();
  yield_where_pinched(world.bodies, context.dt, context.contact.contacts, &context.contact.contacts.pinches);
  yield_where_held(world.bodies, context.contact.contacts);
}

void return_to_start(World& world, StepContext& context) {
  if (!world.meets()) velocity_difference(world.bodies, context.states.v_n, context.states.difference);
  restore_velocities(context.states.v_n, world.bodies);
}

// Collisions on jointed bodies see the response of the whole group. The impulses of the joints are then taken
// back, because stabilize_collided() solves for them and counts them.
void collide(World& world, StepContext& context) {
  ContactStage& contact = context.contact;
  Bodies& bodies = world.bodies;
  ArticulatedResponse* articulated_response =
      world.has(Effect::articulation)
          ? context.joints.response.prepare(bodies, context.joints.solver, ControlledJoints::are_free,
                                            contact.contacts)
          : nullptr;
  if (articulated_response) articulated_response->begin(bodies.rigid);
  process_collisions(bodies, context.states.difference, context.dt, world.settings.collision,
                     articulated_response, contact.contacts, contact.collisions);
  if (!articulated_response) return;
  articulated_response->finish(bodies.rigid);
  articulated_response->release(contact.contacts);
}

void stabilize_collided(World& world, StepContext& context) {
  context.joints.solver.stabilize(world.bodies.rigid);
}

void evolve_again(World& world, StepContext& context) {
  store_velocities(world.bodies, context.states.v_hat_n);
  add_velocities(context.states.difference, world.bodies);
}

}  // namespace duet
