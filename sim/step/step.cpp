#include "sim/step/step.h"

namespace duet {

// The paper's section 2. Between its lines the bodies' velocities are those named on the right.
void step(World& world, double time, double dt) {
  StepContext& context = world.context;
  StageClock& clock = world.clock;
  context.time = time;
  context.dt = dt;
  const bool contact = world.has(Effect::rigid_contact) || world.has(Effect::rigid_deformable_contact);
  const bool collision = contact || world.has(Effect::rigid_collision);

  begin_step(world, context);
  if (world.has(Effect::kinematic_motion))
    clock.time(Stage::kinematic_motion, [&] { plan_motion(world, context); });
  // I    v^n -> v~^{n+1/2}
  clock.time(Stage::advance_velocity, [&] { advance_velocity(world, context); });
  if (world.has(Effect::self_repulsion))
    clock.time(Stage::self_repulsion, [&] { repel_surfaces(world, context); });
  if (collision) clock.time(Stage::broad_phase, [&] { find_contacts(world, context); });
  // II   v^n -> v^^n, v~^{n+1/2} -> v^^{n+1/2}
  if (collision) clock.time(Stage::collide, [&] { collide(world, context); });
  // III  v^^{n+1/2} -> v^{n+1/2}
  if (contact) clock.time(Stage::apply_contact, [&] { apply_contact(world, context); });
  // IV   x^n -> x^{n+1}
  clock.time(Stage::advance_position, [&] { advance_position(world, context); });
  if (world.has(Effect::push_out)) clock.time(Stage::push_out, [&] { push_out(world, context); });
  restore_collided_velocity(world, context);
  if (world.has(Effect::self_collision))
    clock.time(Stage::self_collision, [&] { collide_surfaces(world, context); });
  if (world.has(Effect::self_repulsion))
    clock.time(Stage::self_repulsion, [&] { find_repulsions(world, context); });
  // V    v^^n -> v^{n+1}
  clock.time(Stage::constrained_solve, [&] { constrained_solve(world, context); });
  if (contact) clock.time(Stage::velocity_contact, [&] { apply_velocity_contact(world, context); });
  if (world.has(Effect::self_repulsion))
    clock.time(Stage::self_repulsion, [&] { apply_velocity_repulsions(world, context); });
  end_step(world);
  if (contact) remember(context.contacts, context.graph, dt, context.memory);
}

}  // namespace duet
