// State and motion of rigid bodies.
#pragma once

#include <string>
#include <vector>

#include "sim/base/types.h"
#include "sim/geometry/level_set.h"

namespace duet {

// What a step reads and writes of one body. Angular momentum is the primary variable: the angular velocity
// follows from it and the orientation, w = I(q)^-1 L, after every change of orientation.
struct RigidState {
  Pose pose;                             // centre of mass and principal axes
  Vec3 velocity = Vec3::Zero();          // m/s, of the centre of mass
  Vec3 angular_velocity = Vec3::Zero();  // rad/s, world axes
  Vec3 angular_momentum = Vec3::Zero();  // kg m^2/s, world axes, about the centre of mass
  Mat3 inverse_inertia = Mat3::Zero();   // world axes, 1/(kg m^2); zero for static bodies
};

// What never changes during a run. Static bodies have zero inverse mass and inertia: impulses leave them at
// rest.
struct RigidProperties {
  LevelSet shape;
  std::vector<Vec3> samples;          // m, body space, tested against other bodies' level sets
  std::vector<Vec3> inside;           // m, body space, a point of the body some way in from every sample
  double mass = 0, inverse_mass = 0;  // kg, 1/kg
  Vec3 inertia = Vec3::Zero();        // kg m^2, principal moments
  double friction = 0, restitution = 0;
  double rolling_friction = 0, spinning_friction = 0;  // m, lever arm of the normal force
  bool is_static() const { return inverse_mass == 0; }
};

struct RigidBodies {
  std::vector<RigidState> state;
  std::vector<RigidProperties> properties;
  std::vector<std::string> name;
  std::size_t size() const { return state.size(); }
};

// Recomputes what follows from the orientation: the world inverse inertia, and w from L.
void update_orientation_dependents(RigidState& state, const RigidProperties& properties);

// L from w, for initial states.
void set_angular_velocity(RigidState& state, const RigidProperties& properties, const Vec3& angular_velocity);

// The pose after `dt` with the velocities of `state` (section 4.1). Second order: q' = exp(dt w + dt^2/2 I^-1
// (L x w)) q.
Pose evolved_pose(const RigidState& state, double dt, bool second_order);

inline Vec3 point_velocity(const RigidState& state, const Vec3& offset) {
  return state.velocity + state.angular_velocity.cross(offset);
}

double kinetic_energy(const RigidState& state, const RigidProperties& properties);  // J

}  // namespace duet
