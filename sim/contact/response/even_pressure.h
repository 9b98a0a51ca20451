// Distribution of the load of a flat contact over its points.
#pragma once

#include "sim/contact/response/articulated_response.h"

namespace duet {

/// Spreads the normal impulses p_i over the points of each patch (flat face) of a pair, with the same force
/// and moments:
///   minimize sum p_i^2 / share_i,  p_i >= 0.
/// The solution is p_i = share_i times a linear function of the place: pressure that is even if the load is
/// in the middle, and grows towards the side to which the load moves. The motion does not determine the p_i,
/// because all that have the same force and moments move the bodies alike, but friction acts where the load
/// is.
///
/// Takes the points that touch: those that hold an impulse, or whose normal velocity exceeds their target by
/// at most `tolerance` (m/s, times ContactPoint::precision). Changes ContactPoint::impulse only, not bodies
/// and velocities. Leaves patches of fewer than four touching points alone, and patches that stick: their
/// distribution does not matter, and bodies that have come to rest are not stirred up.
void spread_evenly(const Bodies& bodies, double tolerance, const ContactPair& pair, ContactSet& contacts);

/// Updates the load of each patch of a pair as a whole, before those of its points:
///   p_i <- p_i + y share_i / sum of the shares,  p_i >= 0,
/// with the y that gives the mean normal velocity of the patch the mean of its targets.
///
/// A body that a joint keeps from turning moves alike wherever its face is pressed. If its points were
/// updated one by one, the first of them would take the whole load, and friction would act there: a gripper
/// whose fingers slide on prismatic joints would hold a body by two points, about which it turns and slips.
///
/// Takes the same points as spread_evenly(), and patches of two points or more. Changes impulses and
/// velocities. Leaves patches alone that neither body of a jointed group belongs to, and those that the
/// joints leave less than half of their motion.
/// Returns the largest change of the mean normal velocity of a patch, m/s over its precision.
double load_evenly(Bodies& bodies, ArticulatedResponse& linked, double tolerance, const ContactPair& pair,
                   ContactSet& contacts);

}  // namespace duet
