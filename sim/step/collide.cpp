// Step II: collisions (paper section 4).
#include "sim/coupling/pinching.h"
#include "sim/step/step.h"

namespace duet {

void find_contacts(World& world, StepContext& context) {
  velocity_difference(world.bodies, context.v_n, context.difference);
  find_candidates(world.bodies, world.contact_filter(), context.dt, context.difference, context.contacts);
  context.contacts.pinches.clear();
  yield_where_pinched(world.bodies, context.dt, context.contacts, &context.contacts.pinches);
}

void collide(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;

  // II.1  v^n -> v_*^n
  const bool joints = world.has(Effect::articulation);
  if (!world.meets()) velocity_difference(bodies, context.v_n, context.difference);
  restore_velocities(context.v_n, bodies);
  if (world.meets())
    process_collisions(bodies, context.difference, context.dt, world.settings.collision, context.contacts,
                       context.collision_scratch);
  // II.2  v_*^n -> v^^n
  if (joints) world.clock.time(Stage::joints, [&] { context.joints.stabilize(bodies.rigid); });
  store_velocities(bodies, context.v_hat_n);

  // II.3  v^^{n+1/2} = v^^n + (v~^{n+1/2} - v^n)
  add_velocities(context.difference, bodies);
}

}  // namespace duet
