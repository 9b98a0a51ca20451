// The motion for which forces find the change of their viscosity by a turn of the bodies.
#pragma once

#include <vector>

#include "sim/base/types.h"

namespace duet {

/// Arguments of InternalForces::add_turn_forces(): particles that keep their velocities for some time.
///
/// Functions that add elastic forces take it by pointer: unless it is null, they compute the partial sums of
/// the turn forces too, while the data of a block of elements is in the processor's cache, and keep them for
/// add_kept_turn_forces(). In bodies larger than the cache a pass of its own would read all elements from
/// memory again.
struct Turn {
  const std::vector<Vec3>& v;  ///< velocities by particle, m/s
  double seconds;              ///< s, time from the state of the elastic forces
};

}  // namespace duet
