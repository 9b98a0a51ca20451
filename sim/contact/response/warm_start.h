// The contact cache and warm starts: contact solves begin at the forces of the last step, so that resting
// contact converges over the steps, in a few sweeps each. The speculative targets of contacts are found here,
// too.
#pragma once

#include <functional>
#include <vector>

#include "sim/contact/graph/contact_graph.h"

namespace duet {

/// A contact of the last step with its impulse. `host`, `guest_rigid` and `feature` together name the
/// contact.
struct CachedContact {
  int host = -1,                ///< Rigid body with the level set, as in ContactPoint.
      guest_rigid = -1;         ///< Rigid guest, as in ContactPoint; -1: the guest is deformable.
  FeatureId feature = {};       ///< Place on the guest, as in ContactPoint.
  int unused = 0;               ///< Padding with a value, so that saved states have no undefined bytes.
  Vec3 impulse = Vec3::Zero();  ///< Impulse on the guest, N s, world.
  double duration = 0;          ///< Time over which the impulse acted, s.
  EdgePoint edge = {};          ///< Plane of an edge contact, as in ContactPoint.
};

/// The contact cache: the contacts that held an impulse at the end of the last step, sorted by their names.
/// It is part of the state of a simulation.
using ContactCache = std::vector<CachedContact>;

/// Updates normal, arms, gap and response of the contacts of `graph` for the present positions. Normals of
/// contacts with deformable guests in pairs whose impulses all act at the end of the step, as `acts_at_end`
/// says, become the mean of the present normal and that of the start of the step.
void update_contacts(const ContactGraph& graph, const Bodies& bodies, ContactSet& contacts,
                     const std::function<bool(const ContactPair&)>& acts_at_end = {});

/// The velocity that speculative targets bound.
enum class PredictionFor {
  motion_in_step,     ///< The velocity that moves the bodies through the step (step III).
  velocity_in_solve,  ///< The velocity at the end of the step as a velocity solve finds it.
  velocity_at_end     ///< The velocity with which the bodies end the step (step V).
};

/// Sets ContactPoint::target of the contacts of `graph`, m/s:
///   target = v_rel.n - (gap' - min(gap, 0)) / dt,
/// where gap' is the gap after `dt` (s) with the present velocities, which must not contain impulses of
/// contact yet. To first order about this motion, a contact with this target closes by no more than its gap,
/// on curved surfaces and with turning bodies too. Overlaps are left to interpenetration resolution.
/// For PredictionFor::motion_in_step, ContactPoint::path_velocity of rigid pairs gets what the motion of the
/// place of contact adds to the tangential velocity over the step, so that friction holds the mean velocity.
/// For PredictionFor::velocity_at_end, the target of rigid pairs is at most 0: the bodies end the step along
/// each other, and half of the impulse that turns them along a hollow curve acts at each end of a step.
/// `orientation` says how poses are predicted.
/// The target is at most a tenth of |v_rel|, or of the speed of the place of contact along the host if that
/// is greater: the part of a motion that a curved host may turn towards its normal. Other exceptions: for a
/// deformable guest, gap' is that of the point after a motion with no more of v_rel.n than closes the gap,
/// because internal forces move particles far in a step, and beside an edge the gap does not change in
/// proportion. A contact that meets another plane ahead (impact_plane.h) has the target -gap / dt of that
/// plane. A contact that another one carries the load for, see SampleCulling, has the target minus infinity.
/// For PredictionFor::velocity_at_end, a contact that touches and stays, and whose normal turns in the next
/// step, has
///   target >= -max(gap, 0) / dt,
/// so that the end of the next step does not let it down.
/// With `forces`, the change of the velocities by the forces of half a step, a contact of two rigid bodies
/// that are apart and approach faster than the forces of one step make them has the target minus infinity,
/// too: the next step finds their collision, with its restitution. A contact would stop them before.
void find_speculative_targets(double dt, OrientationUpdate orientation, const ContactGraph& graph,
                              const Bodies& bodies, ContactSet& contacts,
                              PredictionFor stage = PredictionFor::motion_in_step,
                              const VelocityState* forces = nullptr);

/// Starts the contacts at the forces in `cache`: sets the impulse of each contact to its cached
/// force times `duration` (s), or to zero, and applies the impulses of active pairs to the velocities. No
/// impulse exceeds the cached one, and those of an island are scaled down if they would bring it farther from
/// its targets (in kinetic energy) than no impulses at all, because the impulse of an impact is not a lasting
/// force. Also fills contacts.is_cold.
void warm_start(const ContactCache& cache, double duration, ContactGraph& graph, Bodies& bodies,
                ContactSet& contacts);

/// Starts the contacts at `factor` times the impulses that they hold, and applies them to the velocities,
/// scaled down as by warm_start(). Deactivates rigid pairs that did not collide, hold no impulse and do not
/// slide or roll onto a level plane: they still approach each other, and elastic bodies have to bounce before
/// contact stops them.
void warm_start_again(double factor, ContactGraph& graph, Bodies& bodies, ContactSet& contacts);

/// Replaces `cache` by the contacts of `graph` that hold an impulse, which acted over
/// `duration` (s).
void store_contacts(const ContactSet& contacts, const ContactGraph& graph, double duration,
                    ContactCache& cache);

}  // namespace duet
