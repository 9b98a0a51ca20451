// Finds the points that may touch other bodies within a step.
#pragma once

#include "sim/contact/detection/contact_point.h"

namespace duet {

/// Fills `contacts` with all contact points whose gap can close within a step of `dt` (s).
///
/// A point counts if its distance to a rigid body's level set, at the present positions, is less than the
/// speculative margin 1.5 dt (v + d) + 1e-3 r. Here v bounds its speed relative to that body, from the
/// velocities now (v~^{n+1/2}). d is the sum of what `difference`, the change of the velocities since v^n
/// that forces made, is for each of the two: contact may stop one of them and not the other. r is the radius
/// of the box of the smaller body; the last term is for bodies at rest that others push.
///
/// If `filter.reduce_contacts` is set, points of rigid bodies are left out that other points of the same flat
/// face stand for (contact_reduction.h). Pairs of rigid bodies come first, in the order of (host, guest),
/// then pairs with deformable bodies, in the order of (guest, host). Storage is kept from step to step.
void find_candidates(const Bodies& bodies, const CandidateFilter& filter, double dt,
                     const VelocityState& difference, ContactSet& contacts);

}  // namespace duet
