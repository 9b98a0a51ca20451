// The unknowns of a velocity solve: the velocities of all particles and rigid bodies together.
#pragma once

#include <vector>

#include "sim/base/types.h"

namespace duet {

struct Bodies;

/// The velocities of all particles and the twists of all rigid bodies, in world axes.
///
/// It is used for changes of velocities, residuals and search directions as well. Unlike VelocityState it
/// holds angular velocities, so that it is a vector of one linear space; but it does not survive a change of
/// orientation without a change of energy.
struct GeneralizedVelocity {
  std::vector<Vec3> particle;  ///< Velocity of every particle, m/s.
  std::vector<Vec3> linear;    ///< Velocity of the center of mass of every rigid body, m/s.
  std::vector<Vec3> angular;   ///< Angular velocity of every rigid body, rad/s.
};

/// Copies the velocities of all particles and rigid bodies to `out`, which is resized.
void to_generalized(const Bodies& bodies, GeneralizedVelocity& out);

}  // namespace duet
