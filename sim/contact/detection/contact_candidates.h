// Which points may touch which bodies within a step.
#pragma once

#include "sim/contact/detection/contact_point.h"

namespace duet {

// Fills `contacts` with every point whose distance to a rigid body's level set is so small at the positions
// now that it can be reached within `dt`, given the velocities now (v~^{n+1/2}) and `difference`, by how much
// forces changed them since v^n; less those of rigid bodies that others of the same flat face stand for
// (contact_reduction.h). Rigid pairs come first, in the order of (host, guest), then those with deformable
// bodies, in the order of (guest, host). Storage is kept from step to step.
void find_candidates(const Bodies& bodies, const CandidateFilter& filter, double dt,
                     const VelocityState& difference, ContactSet& contacts);

}  // namespace duet
