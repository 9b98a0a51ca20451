// Where contact solves begin: at the forces that bodies exerted on each other a moment ago. Resting contact
// then converges over the steps, and in a few sweeps each.
#pragma once

#include <vector>

#include "sim/contact/graph/contact_graph.h"

namespace duet {

struct CachedContact {
  int host = -1, guest_rigid = -1, guest_point = -1;  // as in ContactPoint; together they name a contact
  int unused = 0;               // written with the rest, so that saved states have no undefined bytes
  Vec3 impulse = Vec3::Zero();  // N s, on the guest
  double duration = 0;          // s, over which it acted
  EdgePoint edge = {};          // as in ContactPoint
};

// The contacts that held a force at the end of the last step, sorted by their names. Part of the state.
using ContactCache = std::vector<CachedContact>;

// Brings the contacts of `graph` to the positions now; the normals of those of deformable bodies to halfway
// from where they were found.
void update_contacts(const ContactGraph& graph, const Bodies& bodies, ContactSet& contacts);

// What the targets are for: the velocity that moves the bodies through the step, or the one that they end it
// with.
enum class PredictionFor { motion_in_step, velocity_at_end };

// Sets the targets of the contacts from where the bodies would be after `dt` (s) with the velocities now,
// when contacts have no impulse yet. Where a contact would then have gap', it may keep of its normal velocity
// what leaves it a gap of zero, to first order about this motion:
//   target = v_rel.n - (gap' - min(gap, 0)) / dt
// So nothing closes by more than its gap, on curved surfaces and with turning bodies too, and overlaps are
// left to push-out. Forces within a deformable body move its particles far in a step, and beside an edge the
// gap does not change in proportion: there it is looked for where the point will be, with no more of v_rel.n
// than closes the gap. Contacts that meet ahead (impact_plane.h) have the target -gap / dt of their plane.
// For the velocity at the end of a step, contacts that touch then and stay are not let down by where the next
// step leads:
//   target >= -max(gap, 0) / dt
void predict_contacts(double dt, OrientationUpdate orientation, const ContactGraph& graph,
                      const Bodies& bodies, ContactSet& contacts,
                      PredictionFor stage = PredictionFor::motion_in_step);

// Gives the contacts of `graph` the impulse that their remembered forces make in `duration` (s), and the
// others none. Never more than they had, and never so much that an island of bodies in contact is farther
// from its targets (in kinetic energy) than without: the impulse of a blow is no force to go on with.
void warm_start(const ContactCache& memory, double duration, ContactGraph& graph, Bodies& bodies,
                ContactSet& contacts);

// The same with `factor` times the impulses that the contacts hold. Rigid pairs that neither collided nor
// hold an impulse become inactive: they are still on their way to each other, and elastic bodies shall bounce
// before contact stops them.
void warm_start_again(double factor, ContactGraph& graph, Bodies& bodies, ContactSet& contacts);

// `duration` (s) is the time over which the contacts' impulses acted.
void remember(const ContactSet& contacts, const ContactGraph& graph, double duration, ContactCache& memory);

}  // namespace duet
