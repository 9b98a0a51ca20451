// Step IV.2 between rigid bodies: interpenetration resolution at all contacts of all pairs at once.
#pragma once

#include <vector>

#include "sim/contact/graph/contact_graph.h"
#include "sim/contact/response/articulated_response.h"

namespace duet {

/// Scratch of separate_rigid_bodies(), kept from step to step so that nothing is allocated.
struct SeparationScratch {
  /// Displacement of a rigid body.
  struct Displacement {
    Vec3 shift = Vec3::Zero();  ///< Translation, m, world.
    Vec3 turn = Vec3::Zero();   ///< Rotation vector, rad, world.
  };
  std::vector<Displacement> body;  ///< For each rigid body.
  std::vector<double> push;        ///< For each contact: pseudo-impulse along the normal, kg m, at least 0.
  std::vector<char> overlaps;      ///< For each pair: whether it overlapped when this geometry was measured.
  std::vector<char> measured;  ///< For each pair: whether its contacts have been updated for this geometry.
};

/// Moves and turns rigid bodies until their contacts overlap by no more than the tolerance. The displacement
/// u solves
///   minimize u.M u / 2  so that  n.u_rel >= -gap  at every contact:
/// the conditions of contact without friction. Equations 1 and 2 of the paper's section 6.1 take one point of
/// each pair instead, which tilts bodies that lie flat. Gauss-Seidel sweeps find u, but slowly if heavy
/// bodies rest on light ones: the rest is taken up level by level by the upper bodies alone, as if the lower
/// ones were fixed. Each of `iterations` measures the overlaps again. Positions and orientations change,
/// velocities and angular momenta do not; overlaps can be left after the last iteration. Returns the number
/// of pairs that overlapped at the start.
///
/// `linked` is the articulated response of the contacts, or null. With it, jointed groups move as their
/// joints allow. Displacements of separate bodies would be taken back by the joints, and for wedged links
/// more than that.
int separate_rigid_bodies(Bodies& bodies, const ArticulatedResponse* linked, ContactGraph& graph,
                          int iterations, ContactSet& contacts, SeparationScratch& scratch);

}  // namespace duet
