#include "sim/scene/joints.h"

#include <cmath>
#include <numbers>

#include "sim/scene/build/motion.h"

namespace duet::scene {
namespace {

constexpr double degree = std::numbers::pi / 180;

// Returns a^-1 b.
Pose inverse_times(const Pose& a, const Pose& b) {
  return {a.to_body(b.position), a.orientation.conjugate() * b.orientation};
}

// Returns the bounds of the simulator, with the values of `interval` times `unit`.
duet::Bounds bounds(const Interval& interval, double unit) {
  duet::Bounds result;
  if (interval.least) result.least = unit * *interval.least;
  if (interval.most) result.most = unit * *interval.most;
  return result;
}

// Converts a target: rotation vectors from degrees to rad, or, if the joint `travels`, displacements along x
// (m) to vectors.
duet::JointTarget target(const JointTarget& from, bool travels) {
  const auto value = [&](const Vec3& turn, double travel) {
    return travels ? Vec3(travel * Vec3::UnitX()) : Vec3(degree * turn);
  };
  duet::JointTarget to;
  to.start = from.start;
  to.constant = value(from.turn, from.travel);
  to.rate = value(from.turn_rate, from.travel_rate);
  for (const TargetSinusoid& swing : from.sinusoid)
    to.sinusoids.push_back({value(swing.turn, swing.travel), swing.period, degree * swing.phase});
  std::vector<PositionKey> keys;
  for (const TargetKey& key : from.keyframes) keys.push_back({key.time, value(key.turn, key.travel)});
  if (!keys.empty())
    to.keys =
        position_track(keys, Interpolation::smooth, from.loop ? AfterLastKey::repeat : AfterLastKey::stay);
  if (from.has_wave)
    to.wave = BodyWave{from.wave.place,  from.wave.spacing, from.wave.wavelength,
                       from.wave.period, from.wave.bend,    from.wave.height};
  return to;
}

}  // namespace

Pose start_of(const RigidBody& body) {
  if (body.is_kinematic) return motion_at(kinematic_motion(body, Pose()), 0).pose;
  return {body.placement.position, body.placement.orientation};
}

Pose frame_of(const JointAxes& axes) {
  Mat3 rotation;
  rotation.col(0) = axes.axis.normalized();
  const Vec3 up = axes.up.value_or(std::abs(rotation(1, 0)) < 0.9 ? Vec3::UnitY() : Vec3::UnitZ());
  rotation.col(1) = (up - up.dot(rotation.col(0)) * rotation.col(0)).normalized();
  rotation.col(2) = rotation.col(0).cross(rotation.col(1));
  return {axes.position.value_or(Vec3::Zero()), Quat(rotation)};
}

JointPlaces places_of(const Joint& joint, const Pose& parent, const Pose& child) {
  if (joint.world.position) return {frame_of(joint.world), frame_of(joint.world)};
  const auto placed = [](const Pose& body, const Pose& frame) {
    return Pose{body.to_world(frame.position), body.orientation * frame.orientation};
  };
  return {placed(parent, frame_of(joint.parent_frame)), placed(child, frame_of(joint.child_frame))};
}

duet::Joint make_joint(const Joint& joint, const EffectSet& plan, const Pose& parent, const Pose& child) {
  duet::Joint made;
  made.name = joint.name;
  made.kind = static_cast<JointKind>(joint.type);
  const JointPlaces places = places_of(joint, parent, child);
  made.parent_frame = inverse_times(parent, places.parent);
  made.child_frame = inverse_times(child, places.child);
  made.friction = joint.friction;
  made.collides = joint.collide;
  if (plan[index(Effect::joint_limits)]) {
    made.angle = bounds(joint.angle, degree);
    made.travel = bounds(joint.travel, 1);
    if (joint.swing) made.swing = degree * *joint.swing;
  }
  if (!joint.has_control || !plan[index(Effect::pd_control)]) return made;
  const JointControl& control = joint.control;
  made.control.on = true;
  made.control.gain = control.gain;
  made.control.damping = control.damping.value_or(2 * std::sqrt(control.gain));
  if (control.torque_limit) made.control.most = *control.torque_limit;
  made.control.axis = {control.x, control.y, control.z};
  made.control.leads = control.lead;
  made.control.target = target(control.target, made.kind == JointKind::prismatic);
  return made;
}

}  // namespace duet::scene
