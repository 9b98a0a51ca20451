// Where contact solves begin: at the forces that bodies exerted on each other a moment ago. Resting contact
// then converges over the steps, and in a few sweeps each.
#pragma once

#include <vector>

#include "sim/coupling/contact_graph.h"

namespace duet {

struct RememberedContact {
  int host = -1, guest_rigid = -1, guest_point = -1;  // as in ContactPoint; together they name a contact
  int unused = 0;             // written with the rest, so that saved states have no undefined bytes
  Vec3 force = Vec3::Zero();  // N, on the guest
};

// The contacts that held a force at the end of the last step, sorted by their names. Part of the state.
using ContactMemory = std::vector<RememberedContact>;

// Gives the contacts of `graph` the impulse that their remembered forces make in `duration` (s), and the
// others none.
void warm_start(const ContactMemory& memory, double duration, const ContactGraph& graph, Bodies& bodies,
                ContactSet& contacts);

// Brings the contacts to the positions now and gives them `factor` times the impulses they hold. Rigid pairs
// that neither collided nor hold an impulse become inactive: they are still on their way to each other, and
// elastic bodies shall bounce before contact stops them.
void warm_start_again(double factor, const ContactGraph& graph, Bodies& bodies, ContactSet& contacts);

// `duration` (s) is the time over which the contacts' impulses acted.
void remember(const ContactSet& contacts, const ContactGraph& graph, double duration, ContactMemory& memory);

}  // namespace duet
