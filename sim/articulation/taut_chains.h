// Chains of joints that lie straight between two places of one body.
#pragma once

#include "sim/articulation/joint.h"
#include "sim/rigid/rigid_bodies.h"

namespace duet {

/// Finds the taut chains among `articulation` at the poses of `rigid`, and sets the lines of their joints.
///
/// A loop of bodies that pins connect (point, hinge and universal joints) is taut if the distance of two
/// neighboring pins equals the sum of all other such distances:
///
///     l_0 = l_1 + ... + l_{k-1},  k >= 3.
///
/// These distances are constants, so that by the triangle inequality its pins stay on one line for ever: a
/// bridge of planks that is as long as the distance of its anchors. The rows of the pins alone do not say so.
/// Across the line they leave velocities free to first order, although no place can change, and loads would
/// make these velocities grow without end.
/// Joints with Joint::is_taut() have rows that keep the line straight.
///
/// Static bodies count as one body, and so do bodies that welds connect. The function examines the loops that
/// one pin closes together with a tree of shortest paths over other pins. A joint of several taut chains gets
/// the line of the first.
void find_taut_chains(Articulation& articulation, const RigidBodies& rigid);

}  // namespace duet
