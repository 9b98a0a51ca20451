#include "sim/rigid/rigid_bodies.h"

#include "sim/base/assert.h"
#include "sim/base/rotation.h"

namespace duet {

void update_orientation_dependents(RigidState& state, const RigidProperties& properties) {
  if (!properties.is_dynamic()) return;
  DUET_ASSERT(is_unit(state.pose.orientation) && properties.inertia.minCoeff() > 0);
  const Mat3 rotation = state.pose.orientation.toRotationMatrix();
  state.inverse_inertia = rotation * properties.inertia.cwiseInverse().asDiagonal() * rotation.transpose();
  state.angular_velocity = state.inverse_inertia * state.angular_momentum;
}

void set_angular_velocity(RigidState& state, const RigidProperties& properties,
                          const Vec3& angular_velocity) {
  DUET_ASSERT(properties.is_dynamic());
  const Mat3 rotation = state.pose.orientation.toRotationMatrix();
  state.angular_momentum =
      rotation * properties.inertia.asDiagonal() * rotation.transpose() * angular_velocity;
  update_orientation_dependents(state, properties);
}

namespace {

// Returns the rotation over `dt` (s) by the rule `update`. Bodies without inverse inertia are not dynamic,
// and turn at their constant rate.
Quat rotation_over(const RigidState& state, double dt, OrientationUpdate update) {
  const Vec3& w = state.angular_velocity;
  if (update == OrientationUpdate::first_order || state.inverse_inertia.isZero(0)) return exponential(dt * w);
  if (update == OrientationUpdate::exact)
    return free_rotation(state.inverse_inertia, state.angular_momentum, dt);
  return exponential(dt * w + dt * dt / 2 * (state.inverse_inertia * state.angular_momentum.cross(w)));
}

}  // namespace

Pose evolved_pose(const RigidState& state, double dt, OrientationUpdate update) {
  Pose pose;
  pose.position = state.pose.position + state.delay + dt * state.velocity;
  pose.orientation = (rotation_over(state, dt, update) * state.pose.orientation).normalized();
  return pose;
}

void move_body_space(const Pose& frame, RigidState& state, RigidProperties& properties) {
  const Pose shape = properties.shape_frame.value_or(Pose());
  properties.shape_frame =
      Pose{frame.to_body(shape.position), (frame.orientation.conjugate() * shape.orientation).normalized()};
  state.velocity = point_velocity(state, state.pose.orientation * frame.position);
  state.pose.position = state.pose.to_world(frame.position);
  state.pose.orientation = (state.pose.orientation * frame.orientation).normalized();
}

double kinetic_energy(const RigidState& state, const RigidProperties& properties) {
  return 0.5 * (properties.mass * state.velocity.squaredNorm() +
                state.angular_momentum.dot(state.angular_velocity));
}

}  // namespace duet
