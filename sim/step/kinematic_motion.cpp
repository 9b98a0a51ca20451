#include "sim/step/kinematic_motion.h"

#include <algorithm>
#include <limits>

#include "sim/base/rotation.h"

namespace duet {
namespace {

// Sets the path velocities of one pair's contacts with the kinematic body of `step`.
void set_path_velocities(const Bodies& bodies, const KinematicStep& step, const ContactPair& pair,
                         ContactSet& contacts) {
  const Vec3& center = bodies.rigid.state[step.body].pose.position;
  for (int i = pair.begin; i < pair.end; ++i) {
    ContactPoint& contact = contacts.points[as_index(i)];
    const bool hosts = as_index(contact.host) == step.body;
    const Vec3 velocity =
        step.path * (bodies.rigid.state[as_index(contact.host)].pose.position + contact.host_arm - center);
    contact.path_velocity = hosts ? Vec3(-velocity) : velocity;
  }
}

}  // namespace

double next_jump(const RigidBodies& rigid, double time, double near) {
  double next = std::numeric_limits<double>::infinity();
  for (const KinematicBody& kinematic : rigid.kinematic)
    next = std::min(next, next_jump(kinematic.motion, time + near));
  return next;
}

void take_velocities_after_jumps(double time, double near, Bodies& bodies) {
  for (std::size_t k = 0; k < bodies.rigid.kinematic.size(); ++k) {
    const KinematicBody& kinematic = bodies.rigid.kinematic[k];
    const double jump = next_jump(kinematic.motion, time - near);
    if (jump > time + near) continue;
    const MotionState after = motion_at(kinematic.motion, jump + near);
    RigidState& state = bodies.rigid.state[kinematic.body];
    state.velocity = after.velocity;
    state.angular_velocity = after.angular_velocity;
    for (const PrescribedParticle& carried : bodies.carried)
      if (carried.kinematic == k)
        bodies.particles.v[as_index(carried.particle)] =
            after.velocity + after.angular_velocity.cross(state.pose.orientation * carried.arm);
  }
}

void evaluate_motions(const RigidBodies& rigid, double end, double dt, double near,
                      std::vector<KinematicStep>& steps) {
  steps.resize(rigid.kinematic.size());
  for (std::size_t k = 0; k < steps.size(); ++k) {
    KinematicStep& step = steps[k];
    step.body = rigid.kinematic[k].body;
    step.end = motion_at(rigid.kinematic[k].motion, end);
    if (const double jump = next_jump(rigid.kinematic[k].motion, end - near); jump <= end + near) {
      const MotionState before = motion_at(rigid.kinematic[k].motion, jump - near);
      step.end.velocity = before.velocity;
      step.end.angular_velocity = before.angular_velocity;
    }
    const Pose& start = rigid.state[step.body].pose;
    const Quat turn = step.end.pose.orientation * start.orientation.conjugate();
    step.mean_velocity = (step.end.pose.position - start.position) / dt;
    step.mean_angular_velocity = logarithm(turn) / dt;
    step.path = (turn.toRotationMatrix() - Mat3::Identity()) / dt - skew(step.mean_angular_velocity);
  }
}

void carry(const std::vector<KinematicStep>& steps, const std::vector<Vec3>& x_n, double dt, Bodies& bodies) {
  for (const PrescribedParticle& carried : bodies.carried) {
    const auto p = as_index(carried.particle);
    const Vec3 end = steps[carried.kinematic].end.pose.to_world(carried.arm);
    bodies.particles.v[p] = (end - x_n[p]) / dt;
  }
}

void place_carried(const std::vector<KinematicStep>& steps, Bodies& bodies) {
  for (const PrescribedParticle& carried : bodies.carried)
    bodies.particles.x[as_index(carried.particle)] = steps[carried.kinematic].end.pose.to_world(carried.arm);
}

void end_carrying(const std::vector<KinematicStep>& steps, Bodies& bodies) {
  for (const PrescribedParticle& carried : bodies.carried) {
    const MotionState& end = steps[carried.kinematic].end;
    bodies.particles.v[as_index(carried.particle)] =
        end.velocity + end.angular_velocity.cross(end.pose.orientation * carried.arm);
  }
}

void set_path_velocities(const Bodies& bodies, const std::vector<KinematicStep>& steps,
                         const ContactGraph& graph, ContactSet& contacts) {
  for (const KinematicStep& step : steps)
    for (int i = graph.first_pair[step.body]; i < graph.first_pair[step.body + 1]; ++i)
      set_path_velocities(bodies, step, contacts.pairs[as_index(graph.pair_of_body[as_index(i)])], contacts);
}

}  // namespace duet
