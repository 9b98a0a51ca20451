// Step III: contact (paper section 5).
#include "sim/step/step.h"

namespace duet {

namespace {

// Where no impulse is known to begin with, as at the start of a scene, the solve may take so many times more
// sweeps: a house of cards would otherwise lean before its forces are found.
constexpr int cold_start = 10;

}  // namespace

void solve_contacts(World& world, StepContext& context) {
  ContactSolveSettings settings = world.settings.contact;
  if (context.memory.empty()) settings.iterations *= cold_start;
  world.counters.contact_sweeps += solve_contact(world.bodies, context.graph, settings, context.contacts);
  if (world.has(Effect::shock_propagation))
    world.clock.time(Stage::shock_propagation, [&] {
      propagate_shocks(world.bodies, context.graph, world.settings.contact, context.contacts);
    });
}

void apply_contact(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  // III.1
  build_contact_graph(bodies, world.gravity, world.has(Effect::rigid_contact), context.contacts,
                      context.graph);
  if (world.has(Effect::shock_propagation)) separate_levels(bodies, context.contacts, context.graph);
  set_path_velocities(bodies, context.kinematic, context.graph, context.contacts);
  predict_contacts(context.dt, world.settings.second_order_orientation, context.graph, bodies,
                   context.contacts);
  // III.3, from the forces that the last step ended with
  warm_start(context.memory, context.dt / 2, context.graph, bodies, context.contacts);
  solve_contacts(world, context);
  check_finite(world, "III.3 apply contact");
}

}  // namespace duet
