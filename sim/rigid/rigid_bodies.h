// State and constant properties of rigid bodies, and how a state moves.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/base/types.h"
#include "sim/geometry/level_set/feature_edges.h"
#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/level_set/round_surface.h"
#include "sim/rigid/kinematic_motion.h"
#include "sim/rigid/orientation_update.h"

namespace duet {

/// The state of one rigid body, which a step reads and writes.
///
/// Angular momentum is the primary variable of a dynamic body: the angular velocity w = I(q)^-1 L follows
/// from it and the orientation, after every change of orientation. A kinematic body has no finite momentum;
/// its angular velocity is prescribed, like the rest of its state.
struct RigidState {
  Pose pose;                             ///< center of mass and principal axes
  Vec3 velocity = Vec3::Zero();          ///< m/s, of the center of mass
  Vec3 angular_velocity = Vec3::Zero();  ///< rad/s, world axes
  Vec3 angular_momentum = Vec3::Zero();  ///< kg m^2/s, world axes, about the center of mass
  Mat3 inverse_inertia = Mat3::Zero();   ///< 1/(kg m^2), world axes; zero for all but dynamic bodies
  /// m: what impacts within the step change of the place at its end, beyond what the velocities do, see
  /// sim/contact/response/impact_delay.h. Zero between steps.
  Vec3 delay = Vec3::Zero();
};

/// The properties of one rigid body, which never change during a run.
///
/// A body is dynamic, kinematic (it moves as the scene prescribes) or static. Only dynamic bodies have mass;
/// the others have zero inverse mass and inertia, so that impulses change nothing.
///
/// Body space has the center of mass at its origin and the principal axes as axes. Shape space, in which the
/// members that describe the shape are, is body space too, except for bones whose center of mass or principal
/// axes are not those of their shape, because they carry the mass of particles: see `shape_frame`.
struct RigidProperties {
  /// Signed distance function of the body, in shape space.
  LevelSet shape;
  std::vector<Vec3> samples;   ///< m, shape space: points that are tested against other bodies' level sets
  std::vector<Vec3> inside;    ///< m, shape space: per sample, a point that lies deeper inside the body
  std::vector<char> on_flat;   ///< per sample, 1 if it lies in a flat face
  FeatureEdges feature_edges;  ///< feature edges, along which the body can touch between its samples
  std::shared_ptr<const RoundSurface> round;  ///< round parts of a mesh; null: none
  std::vector<RoundSample> on_round;          ///< what samples are on `round`; empty without it
  /// Pose of shape space in body space; none if the two are the same.
  std::optional<Pose> shape_frame = {};
  double mass = 0,              ///< kg; 0: not dynamic
      inverse_mass = 0;         ///< 1/kg; 0: not dynamic
  Vec3 inertia = Vec3::Zero();  ///< kg m^2, principal moments
  double friction = 0,          ///< Coulomb coefficient, 1
      restitution = 0;          ///< coefficient of restitution, 0 to 1
  double rolling_friction = 0,  ///< m, lever arm of the normal force against rolling
      spinning_friction = 0;    ///< m, lever arm of the normal force against spinning about the normal
  double air_drag = 0;          ///< 1/m, deceleration over the square of the speed
  /// True if the scene prescribes its motion.
  bool is_kinematic = false;
  /// Returns whether forces move the body.
  bool is_dynamic() const { return inverse_mass > 0; }
  /// Returns whether the body is dynamic or kinematic.
  bool moves() const { return is_dynamic() || is_kinematic; }
  /// Returns whether the body is a ball about its center of mass, so that no turn can be seen.
  bool is_ball() const { return shape.kind == LevelSet::Kind::sphere && !shape_frame; }
};

/// A rigid body with prescribed motion.
struct KinematicBody {
  std::size_t body = 0;    ///< index of the rigid body
  KinematicMotion motion;  ///< its motion
};

/// All rigid bodies of a scene; the first three arrays have one entry per body.
struct RigidBodies {
  std::vector<RigidState> state;            ///< states
  std::vector<RigidProperties> properties;  ///< constant properties
  std::vector<std::string> name;            ///< names in the scene file
  std::vector<KinematicBody> kinematic;     ///< the bodies with prescribed motion
  /// Returns the number of rigid bodies.
  std::size_t size() const { return state.size(); }
};

/// Returns the variable of a body's rotation that a change of orientation leaves alone.
///
/// It is the angular momentum (kg m^2/s) of a dynamic body, and the angular velocity (rad/s) of any other.
inline Vec3& rotation_variable(RigidState& state, const RigidProperties& properties) {
  return properties.is_dynamic() ? state.angular_momentum : state.angular_velocity;
}
/// Returns the variable of a body's rotation that a change of orientation leaves alone, for reading.
///
/// It is the angular momentum (kg m^2/s) of a dynamic body, and the angular velocity (rad/s) of any other.
inline const Vec3& rotation_variable(const RigidState& state, const RigidProperties& properties) {
  return properties.is_dynamic() ? state.angular_momentum : state.angular_velocity;
}

/// Returns the pose that takes shape space to the world, if `pose` takes body space there.
inline Pose shape_pose(const RigidProperties& properties, const Pose& pose) {
  if (!properties.shape_frame) return pose;
  const Pose& frame = *properties.shape_frame;
  return {pose.to_world(frame.position), pose.orientation * frame.orientation};
}
/// Returns the present pose of the shape of a body: it takes shape space to the world.
inline Pose shape_pose(const RigidBodies& rigid, std::size_t body) {
  return shape_pose(rigid.properties[body], rigid.state[body].pose);
}

/// Recomputes the inverse inertia in world axes and w = I^-1 L of a dynamic body from its orientation.
///
/// To be called after every change of orientation. It changes nothing of other bodies.
void update_orientation_dependents(RigidState& state, const RigidProperties& properties);

/// Sets the rotation of a dynamic body to `angular_velocity` (rad/s, world axes): L = I w.
///
/// It recomputes the inverse inertia in world axes as well.
void set_angular_velocity(RigidState& state, const RigidProperties& properties, const Vec3& angular_velocity);

/// Returns the pose after `dt` (s) with the velocities of `state`, with the delay of its impacts.
///
/// Dynamic bodies turn by the rule `update`, all others at their constant rate.
Pose evolved_pose(const RigidState& state, double dt, OrientationUpdate update);

/// Returns the velocity v + w x offset (m/s) of the point at `offset` (m, world axes) from the center of
/// mass.
inline Vec3 point_velocity(const RigidState& state, const Vec3& offset) {
  return state.velocity + state.angular_velocity.cross(offset);
}

/// Returns the velocity of the origin of a body's shape space, m/s: that of the center of mass if the two are
/// the same point.
inline Vec3 shape_velocity(const RigidState& state, const RigidProperties& properties) {
  if (!properties.shape_frame) return state.velocity;
  return point_velocity(state, state.pose.orientation * properties.shape_frame->position);
}

/// Moves the center of mass and the axes of a body: `frame` is its new body space in the present one.
///
/// The body's shape and the motion of its points stay. The caller sets mass and inertia (in the new axes)
/// before, and recomputes the angular momentum after.
void move_body_space(const Pose& frame, RigidState& state, RigidProperties& properties);

/// Returns the kinetic energy (m v.v + L.w) / 2 of a body, J; zero for a body without mass.
double kinetic_energy(const RigidState& state, const RigidProperties& properties);

}  // namespace duet
