#include "sim/simulation/steering.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/base/near_miss.h"
#include "sim/base/rotation.h"
#include "sim/scene/build/motion.h"

namespace duet {
namespace {

[[noreturn]] void refuse(const std::string& message) { throw Error(ExitStatus::usage, message); }

[[noreturn]] void refuse_unknown(const char* what, const std::string& name,
                                 const std::vector<std::string>& known) {
  const std::string hint = did_you_mean(name, known);
  refuse(fmt::format("there is no {} `{}`{}", what, name, hint.empty() ? "" : " (" + hint + ")"));
}

template <class Items>
std::vector<std::string> names_of(const Items& items) {
  std::vector<std::string> names;
  for (const auto& item : items) names.push_back(item.name);
  return names;
}

template <class Items>
auto find_by_name(Items& items, const std::string& name) {
  return std::find_if(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
}

// Returns the motion that places body space as `pose`, in the coordinates of the shape that `frame` relates
// to body space.
Pose of_shape(const Pose& pose, const Pose& frame) {
  Pose shape;
  shape.orientation = (pose.orientation * frame.orientation.conjugate()).normalized();
  shape.position = pose.position - shape.orientation * frame.position;
  return shape;
}

// Appends a key, and the uniform increments of the interval before it. The cumulative Bernstein polynomials
// add up to 3 s, so that equal thirds make uniform motion.
template <class Value>
void add_key(Track<Value>& track, double time, const Value& value, const Vec3& increment) {
  if (!track.time.empty()) track.increment.push_back({increment / 3, increment / 3, increment / 3});
  track.time.push_back(time);
  track.value.push_back(value);
}

}  // namespace

BodyIndex find_body(const Bodies& bodies, const std::string& name) {
  const auto rigid = std::find(bodies.rigid.name.begin(), bodies.rigid.name.end(), name);
  if (rigid != bodies.rigid.name.end())
    return {true, static_cast<std::size_t>(rigid - bodies.rigid.name.begin())};
  const auto soft = find_by_name(bodies.deformable, name);
  if (soft != bodies.deformable.end())
    return {false, static_cast<std::size_t>(soft - bodies.deformable.begin())};
  std::vector<std::string> known = bodies.rigid.name;
  for (const DeformableBody& body : bodies.deformable) known.push_back(body.name);
  refuse_unknown("body", name, known);
}

void require_finite(const Vec3& value, const std::string& what) {
  if (!value.allFinite())
    refuse(fmt::format("{} is ({}, {}, {}): give finite numbers", what, value.x(), value.y(), value.z()));
}

void aim_joint(Articulation& articulation, const std::string& name, const Vec3& value, TimeSpan span) {
  require_finite(value, fmt::format("the target of joint `{}`", name));
  const auto joint = find_by_name(articulation.joints, name);
  if (joint == articulation.joints.end()) refuse_unknown("joint", name, names_of(articulation.joints));
  if (!joint->control.on)
    refuse(fmt::format("joint `{}` has no target: give it `control` in the scene", name));
  const Vec3 now = joint->control.target.value(span.begin);
  JointTarget target;
  add_key(target.keys, span.begin, now, Vec3::Zero());
  add_key(target.keys, span.end, value, value - now);
  joint->control.target = std::move(target);
}

std::size_t aim_body(RigidBodies& rigid, const std::string& name, const Pose& pose, TimeSpan span) {
  require_finite(pose.position, fmt::format("the target position of `{}`", name));
  if (!(pose.orientation.norm() > 0.5 && pose.orientation.norm() < 2))
    refuse(fmt::format("the target orientation of `{}` is no unit quaternion", name));
  const auto found = std::find(rigid.name.begin(), rigid.name.end(), name);
  if (found == rigid.name.end()) refuse_unknown("rigid body", name, rigid.name);
  const auto body = static_cast<std::size_t>(found - rigid.name.begin());
  const auto kinematic = std::find_if(rigid.kinematic.begin(), rigid.kinematic.end(),
                                      [&](const KinematicBody& one) { return one.body == body; });
  if (kinematic == rigid.kinematic.end())
    refuse(fmt::format("`{}` has no target: it is not kinematic (give it a `motion` in the scene)", name));
  KinematicMotion motion;
  motion.frame = kinematic->motion.frame;
  const Pose start = of_shape(rigid.state[body].pose, motion.frame),
             end = of_shape({pose.position, pose.orientation.normalized()}, motion.frame);
  const Vec3 shift = end.position - start.position,
             turn = logarithm(end.orientation * start.orientation.conjugate());
  const double later = span.end + (span.end - span.begin);
  add_key(motion.position, span.begin, start.position, shift);
  add_key(motion.position, span.end, end.position, shift);
  add_key(motion.position, later, Vec3(end.position + shift), shift);
  add_key(motion.orientation, span.begin, start.orientation, turn);
  add_key(motion.orientation, span.end, end.orientation, turn);
  add_key(motion.orientation, later, Quat(exponential(turn) * end.orientation), turn);
  kinematic->motion = std::move(motion);
  return static_cast<std::size_t>(kinematic - rigid.kinematic.begin());
}

void stop_body(RigidBodies& rigid, std::size_t number, double time) {
  KinematicBody& kinematic = rigid.kinematic[number];
  const Pose end = of_shape(motion_at(kinematic.motion, time).pose, kinematic.motion.frame);
  KinematicMotion motion;
  motion.frame = kinematic.motion.frame;
  add_key(motion.position, time, end.position, Vec3::Zero());
  add_key(motion.orientation, time, end.orientation, Vec3::Zero());
  kinematic.motion = std::move(motion);
}

void push_body(World& world, const std::string& name, const Vec3& force, const Vec3& moment,
               const std::optional<Vec3>& at) {
  require_finite(force, fmt::format("the force on `{}`", name));
  require_finite(moment, fmt::format("the moment on `{}`", name));
  if (at) require_finite(*at, fmt::format("the point of the force on `{}`", name));
  const Bodies& bodies = world.bodies;
  const auto [is_rigid, body] = find_body(bodies, name);
  if (is_rigid) {
    if (!bodies.rigid.properties[body].is_dynamic())
      refuse(fmt::format("`{}` takes no force: it is not dynamic", name));
    const Vec3 arm =
        at.value_or(shape_pose(bodies.rigid, body).position) - bodies.rigid.state[body].pose.position;
    return add_to_rigid(bodies, body, force, moment + arm.cross(force), world.applied);
  }
  if (!moment.isZero(0))
    refuse(fmt::format("`{}` takes no moment: it is deformable (add forces at points instead)", name));
  if (!at) return add_to_deformable(bodies, body, force, world.applied);
  double nearest = std::numeric_limits<double>::infinity();  // m^2
  std::optional<std::size_t> particle;
  for_each_particle(bodies.deformable[body], [&](std::size_t p) {
    const double distance = (bodies.particles.x[p] - *at).squaredNorm();
    if (is_held(bodies.particles, p) || distance >= nearest) return;
    nearest = distance;
    particle = p;
  });
  if (!particle) refuse(fmt::format("`{}` takes no force: all of its particles are held", name));
  add_to_particle(bodies, *particle, force, world.applied);
}

scene::Scene released(const scene::Scene& scene, const std::string& name, std::optional<double> density) {
  scene::Scene changed = scene;
  const auto refuse_density = [&] {
    if (density)
      refuse(fmt::format(
          "a density has no effect when `{}` is released: only static and kinematic bodies take it", name));
  };
  if (const auto joint = find_by_name(changed.joints, name); joint != changed.joints.end()) {
    refuse_density();
    changed.joints.erase(joint);
    return changed;
  }
  if (const auto soft = find_by_name(changed.deformable, name); soft != changed.deformable.end()) {
    refuse_density();
    if (soft->pins.empty() && soft->attach.empty())
      refuse(fmt::format("nothing holds `{}`: it has no pins and no `attach`", name));
    soft->pins.clear();
    soft->attach.clear();
    soft->attach_springs.reset();
    return changed;
  }
  const auto body = find_by_name(changed.rigid, name);
  if (body == changed.rigid.end()) {
    std::vector<std::string> known = names_of(changed.joints);
    for (const auto& more : {names_of(changed.rigid), names_of(changed.deformable)})
      known.insert(known.end(), more.begin(), more.end());
    refuse_unknown("joint or body", name, known);
  }
  if (!body->is_static && !body->is_kinematic)
    refuse(
        fmt::format("nothing holds `{}`: it is dynamic already (a joint is released by its own name)", name));
  if (!density || !(*density > 0 && *density < 1e9))
    refuse(fmt::format("`{}` has no mass: give a density above 0 kg/m^3 to release it", name));
  for (const scene::DeformableBody& other : changed.deformable)
    for (const scene::Pin& pin : other.pins)
      if (pin.body == name)
        refuse(
            fmt::format("`{}` carries particles of `{}`: release `{}` first", name, other.name, other.name));
  if (body->is_kinematic) {
    const Pose start = motion_at(scene::kinematic_motion(*body, Pose()), 0).pose;
    body->placement.position = start.position;
    body->placement.orientation = start.orientation;
  }
  body->is_static = body->is_kinematic = false;
  body->motion = {};
  body->density = density;
  return changed;
}

namespace {

// Carries the states of rigid bodies. A body whose inertia has changed, as that of a bone without its flesh,
// goes on in the same rigid motion.
void carry_rigid(const RigidBodies& from, RigidBodies& to) {
  for (std::size_t i = 0; i < to.size(); ++i) {
    const RigidProperties &before = from.properties[i], &after = to.properties[i];
    to.state[i] = from.state[i];
    if (before.mass == after.mass && before.inertia == after.inertia) continue;
    if (before.shape_frame || after.shape_frame) {
      const Pose shape = shape_pose(from, i), frame = after.shape_frame.value_or(Pose());
      Pose& pose = to.state[i].pose;
      pose.orientation = (shape.orientation * frame.orientation.conjugate()).normalized();
      pose.position = shape.position - pose.orientation * frame.position;
      to.state[i].velocity = point_velocity(from.state[i], pose.position - from.state[i].pose.position);
    }
    update_orientation_dependents(to.state[i], after);
    set_angular_velocity(to.state[i], after, from.state[i].angular_velocity);
  }
  for (KinematicBody& kinematic : to.kinematic)
    for (const KinematicBody& before : from.kinematic)
      if (before.body == kinematic.body) kinematic.motion = before.motion;
}

// Adds the pairs `from` to the sorted list `to`.
void add_pairs(const std::vector<std::pair<int, int>>& from, std::vector<std::pair<int, int>>& to) {
  to.insert(to.end(), from.begin(), from.end());
  std::sort(to.begin(), to.end());
  to.erase(std::unique(to.begin(), to.end()), to.end());
}

}  // namespace

void carry_over(World& from, World& to) {
  carry_rigid(from.bodies.rigid, to.bodies.rigid);
  to.bodies.particles.x = from.bodies.particles.x;
  to.bodies.particles.v = from.bodies.particles.v;
  to.bodies.forces.set_max_omega_squared(
      std::max(to.bodies.forces.max_omega_squared(), from.bodies.forces.max_omega_squared()));
  for (std::size_t j = 0; j < to.bodies.articulation.joints.size(); ++j) {
    Joint& joint = to.bodies.articulation.joints[j];
    const std::vector<Joint>& joints = from.bodies.articulation.joints;
    const auto before = find_by_name(joints, joint.name);
    if (before == joints.end()) continue;
    joint.control.target = before->control.target;
    if (!to.last_step.control_angle.empty() && !from.last_step.control_angle.empty())
      to.last_step.control_angle[j] = from.last_step.control_angle[as_index(before - joints.begin())];
  }
  to.last_step.acceleration = from.last_step.acceleration;
  if (to.last_step.surface_friction.size() == from.last_step.surface_friction.size())
    to.last_step.surface_friction = from.last_step.surface_friction;
  if (to.last_step.joint_drive.linear.size() == from.last_step.joint_drive.linear.size())
    to.last_step.joint_drive = from.last_step.joint_drive;
  if (to.last_step.pressure.size() == from.last_step.pressure.size())
    to.last_step.pressure = from.last_step.pressure;
  if (to.bodies.particles.size() == from.bodies.particles.size())
    to.last_step.pair_forces = from.last_step.pair_forces;
  // Cached contacts name points, edges and faces by their numbers.
  if (to.bodies.points.size() == from.bodies.points.size() &&
      to.bodies.edges.size() == from.bodies.edges.size() &&
      to.bodies.triangles.size() == from.bodies.triangles.size())
    to.last_step.contact_cache = from.last_step.contact_cache;
  // Bodies of a joint, and bones in flesh, overlap: if they could touch now, they would be thrown apart.
  add_pairs(from.bodies.collision_exclusions, to.bodies.collision_exclusions);
  add_pairs(from.bodies.collision_exclusions_deformable, to.bodies.collision_exclusions_deformable);
  to.settings.push_out.overlapping = from.settings.push_out.overlapping;
  to.applied = from.applied;
  to.clock = from.clock;
  to.counters = from.counters;
  to.ledger = from.ledger;
  to.contact_tally = from.contact_tally;
  to.stage_hashes = from.stage_hashes;
}

}  // namespace duet
