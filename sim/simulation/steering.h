// Changes that a caller makes to a running simulation between two frames: new targets of motors and kinematic
// bodies, and bodies that are let go. Implements the functions of Simulation that steer.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/step/world.h"

namespace duet {

/// An interval of simulated time.
struct TimeSpan {
  double begin = 0,  ///< s
      end = 0;       ///< s
};

/// A rigid or deformable body by its index.
struct BodyIndex {
  bool is_rigid = true;   ///< whether `index` is that of a rigid body
  std::size_t index = 0;  ///< into RigidBodies or Bodies::deformable
};

/// Returns the body called `name`. Throws Error (usage) with a near miss if there is none.
BodyIndex find_body(const Bodies& bodies, const std::string& name);

/// Throws Error (usage) that names `what` unless all numbers of `value` are finite.
void require_finite(const Vec3& value, const std::string& what);

/// Lets the target of joint `name` go linearly over `span` from its present value to `value` (rad, or m along
/// x of a prismatic joint), where it stays. Throws Error (usage) if there is no such joint or no control.
void aim_joint(Articulation& articulation, const std::string& name, const Vec3& value, TimeSpan span);

/// Lets kinematic body `name` move over `span` from its present pose to `pose` (center of mass and principal
/// axes), with constant velocity and angular velocity, by the shortest rotation.
///
/// The motion goes on at these rates for as long again, so that the velocity at the end of the span is that
/// within it. Returns the index into RigidBodies::kinematic. Throws Error (usage) if there is no such body,
/// or it is not kinematic.
std::size_t aim_body(RigidBodies& rigid, const std::string& name, const Pose& pose, TimeSpan span);
/// Stops kinematic body `number` at its pose of `time` (s).
void stop_body(RigidBodies& rigid, std::size_t number, double time);

/// Adds a force (N) and a moment (N m) on body `name`, as Simulation::add_force() does.
void push_body(World& world, const std::string& name, const Vec3& force, const Vec3& moment,
               const std::optional<Vec3>& at);

/// Returns `scene` without what holds `name`: without the joint of that name; with a dynamic body in place of
/// a static or kinematic one, which gets `density` (kg/m^3); or without the pins and attachments of a
/// deformable body. Throws Error (usage) if there is no such joint or body, nothing holds it, a kinematic
/// body carries particles, or the density is missing or has no effect.
scene::Scene released(const scene::Scene& scene, const std::string& name, std::optional<double> density);

/// Carries state, steered targets and what is recorded from `from` to `to`, the world of the same scene in
/// which something has been released. Joints are matched by name.
void carry_over(World& from, World& to);

}  // namespace duet
