// Step III: contact (paper section 5).
#include "sim/step/step.h"

namespace duet {

void apply_contact(World& world, StepContext& context) {
  build_contact_graph(world.bodies, world.has(Effect::rigid_contact), context.contacts,
                      context.graph);  // III.1
  for (ContactPoint& contact : context.contacts.points) contact.impulse.setZero();
  world.counters.contact_sweeps += solve_contact(world.bodies, context.graph, context.dt,
                                                 world.settings.contact, context.contacts);  // III.3
  check_finite(world, "III.3 apply contact");
}

}  // namespace duet
