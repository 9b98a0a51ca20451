// State and motion of rigid bodies.
#pragma once

#include <string>
#include <vector>

#include "sim/base/types.h"
#include "sim/geometry/level_set/feature_edges.h"
#include "sim/geometry/level_set/level_set.h"
#include "sim/rigid/kinematic_motion.h"
#include "sim/rigid/orientation_update.h"

namespace duet {

// What a step reads and writes of one body. Angular momentum is the primary variable of a dynamic body: the
// angular velocity follows from it and the orientation, w = I(q)^-1 L, after every change of orientation. A
// kinematic body has no finite momentum; its angular velocity is prescribed, like the rest of its state.
struct RigidState {
  Pose pose;                             // centre of mass and principal axes
  Vec3 velocity = Vec3::Zero();          // m/s, of the centre of mass
  Vec3 angular_velocity = Vec3::Zero();  // rad/s, world axes
  Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s, world axes, about the centre of mass
  Mat3 inverse_inertia = Mat3::Zero();   // world axes, 1/(kg m^2); zero for all but dynamic bodies
};

// What never changes during a run. A body is dynamic, kinematic (it moves as the scene prescribes) or static.
// Only dynamic ones have mass; all others have zero inverse mass and inertia, so that impulses change
// nothing.
struct RigidProperties {
  LevelSet shape;
  std::vector<Vec3> samples;          // m, body space, tested against other bodies' level sets
  std::vector<Vec3> inside;           // m, body space, a point of the body some way in from every sample
  std::vector<char> on_flat;          // whether a sample lies in a flat face
  FeatureEdges ridges;                // the lines along which it can touch between its samples
  double mass = 0, inverse_mass = 0;  // kg, 1/kg
  Vec3 inertia = Vec3::Zero();        // kg m^2, principal moments
  double friction = 0, restitution = 0;
  double rolling_friction = 0, spinning_friction = 0;  // m, lever arm of the normal force
  double air_drag = 0;                                 // 1/m, deceleration over the square of the speed
  bool is_kinematic = false;
  bool is_dynamic() const { return inverse_mass > 0; }
  bool moves() const { return is_dynamic() || is_kinematic; }
};

struct KinematicBody {
  std::size_t body = 0;  // index of the rigid body
  KinematicMotion motion;
};

struct RigidBodies {
  std::vector<RigidState> state;
  std::vector<RigidProperties> properties;
  std::vector<std::string> name;
  std::vector<KinematicBody> kinematic;
  std::size_t size() const { return state.size(); }
};

// The variable of a body's rotation that a change of orientation leaves alone: L (kg m^2/s) of a dynamic
// body, w (rad/s) of the others.
inline Vec3& rotation_variable(RigidState& state, const RigidProperties& properties) {
  return properties.is_dynamic() ? state.angular_momentum : state.angular_velocity;
}
inline const Vec3& rotation_variable(const RigidState& state, const RigidProperties& properties) {
  return properties.is_dynamic() ? state.angular_momentum : state.angular_velocity;
}

// Recomputes what follows from the orientation of a dynamic body: the world inverse inertia, and w from L.
void update_orientation_dependents(RigidState& state, const RigidProperties& properties);

// L from w, for initial states.
void set_angular_velocity(RigidState& state, const RigidProperties& properties, const Vec3& angular_velocity);

// The pose after `dt` (s) with the velocities of `state`. Bodies that are not dynamic turn at their rate.
Pose evolved_pose(const RigidState& state, double dt, OrientationUpdate update);

inline Vec3 point_velocity(const RigidState& state, const Vec3& offset) {
  return state.velocity + state.angular_velocity.cross(offset);
}

double kinetic_energy(const RigidState& state, const RigidProperties& properties);  // J

}  // namespace duet
