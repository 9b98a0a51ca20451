// The velocities of all particles and rigid bodies together, in the two forms that a step needs: as a vector
// of a linear space for solves, and as a saved state that a change of orientation does not falsify.
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

/// A saved velocity of every particle and rigid body. Rotation is stored as angular momentum, because an
/// angular velocity that is saved before a change of orientation and restored after it would create energy.
/// It is a type of its own, so that neither is taken for the other.
struct VelocityState {
  std::vector<Vec3> particle;  ///< Velocity of every particle, m/s.
  std::vector<Vec3> rigid;     ///< Velocity of the center of mass of every rigid body, m/s.
  /// Rotation of every rigid body, see rotation_variable(): angular momentum L (kg m^2/s, world axes) of
  /// dynamic bodies, angular velocity (rad/s) of the others.
  std::vector<Vec3> rotation;
};

/// Copies the velocities of `bodies` to `out`, which is resized.
void store_velocities(const Bodies& bodies, VelocityState& out);
/// Sets the velocities of `bodies`. The angular velocity of dynamic bodies follows from L and the present
/// orientation.
void restore_velocities(const VelocityState& velocities, Bodies& bodies);
/// Adds `change` to the velocities of `bodies`. The angular velocity of dynamic bodies follows from L.
void add_velocities(const VelocityState& change, Bodies& bodies);
/// Sets out = (present velocities of `bodies`) - base.
void velocity_difference(const Bodies& bodies, const VelocityState& base, VelocityState& out);

}  // namespace duet
