// Step II: collisions (paper section 4).
#include "sim/coupling/impact_plane.h"
#include "sim/coupling/pinching.h"
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

namespace {

// II.1  v^n -> v_*^n. The joints' part in the blows is left to the joint solver, which has its impulses.
void strike(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  LinkedBodies* linked = world.has(Effect::articulation)
                             ? context.linked.prepare(bodies, context.joints, false, context.contacts)
                             : nullptr;
  if (linked) linked->begin(bodies.rigid);
  process_collisions(bodies, context.difference, context.dt, world.settings.collision, linked,
                     context.contacts, context.collision_scratch);
  if (!linked) return;
  linked->finish(bodies.rigid);
  linked->release(context.contacts);
}

}  // namespace

void collide(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  const bool joints = world.has(Effect::articulation);
  if (!world.meets()) velocity_difference(bodies, context.v_n, context.difference);
  restore_velocities(context.v_n, bodies);
  if (world.meets()) strike(world, context);
  // II.2  v_*^n -> v^^n
  if (joints) world.clock.time(Stage::joints, [&] { context.joints.stabilize(bodies.rigid); });
  store_velocities(bodies, context.v_hat_n);

  // II.3  v^^{n+1/2} = v^^n + (v~^{n+1/2} - v^n)
  add_velocities(context.difference, bodies);
}

}  // namespace duet
