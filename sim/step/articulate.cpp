// Joints in a step, apart from their part in contact and solves: rows at x^n, the checks for too long steps,
// and step IV.3 (paper sections 4 to 7).
#include <algorithm>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/contact/response/ledger.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Largest error of joint positions that a step may leave, m or rad. A larger error ends the step with an
// error.
constexpr double joined = 1e-6;
// Largest turn of a jointed body in a step, over solver.max_rotation. It exceeds 1 because the time-step rule
// knows the rate at the start of the step only.
constexpr double turns_on = 1.5;
// Largest energy error of the motion between the joints, as a fraction of its energy (FreeMotion::Outcome).
// Steps that whip a body about miss a few percent and need to be shorter to follow it; other steps miss 1e-5.
constexpr double max_excess = 0.02;
// Least turn in a step, over solver.max_rotation, at which a shorter step is a remedy. The energy error grows
// with the third power of the turn; in bodies at rest all that moves is rounding. It holds for positions that
// do not fit without contact, too.
constexpr double min_turn = 1e-3;
// Least turn in a step in contact, over solver.max_rotation, at which a shorter step is a remedy for
// positions that do not fit. They fit in a shorter step if a body is whipped about. At smaller turns contact
// leaves them no room, as in a heap, and a step of a 32nd fits no better: a heap of 24 jointed rows took 48
// steps in a frame instead of 6.
constexpr double min_whip = 0.1;

// Throws the error for joints that are `gap` (m or rad) apart after the step.
[[noreturn]] void fail(const World& world, double gap) {
  const Articulation& articulation = world.bodies.articulation;
  const JointSolver::Drift drift = JointSolver::drift(articulation, world.bodies.rigid);
  const Joint& joint = articulation.joints[static_cast<std::size_t>(drift.joint)];
  const auto child = static_cast<std::size_t>(joint.child);
  SimulationFault fault;
  fault.stage = name(Stage::post_stabilization);
  fault.body = world.bodies.rigid.name[child];
  fault.element = fmt::format("joint {}", joint.name);
  fault.position = world.context.states.rigid_n[child].pose.position;
  fault.value = gap;
  fault.bound = joined;
  fault.cause =
      "the joints came apart: a time step too long for how fast they turn, or bodies that cannot fit";
  fault.remedy =
      "lower solver.max_rotation or solver.max_time_step, or look for joints that exclude each other";
  throw SimulationError(fault);
}

// Returns the largest angular velocity of the bodies with joints, rad/s, of the rigid states `state`.
double fastest_turn(const StepContext& context, const std::vector<RigidState>& state) {
  double rate = 0;
  for (const std::size_t body : context.joints.solver.bodies())
    rate = std::max(rate, state[body].angular_velocity.norm());
  return rate;
}

}  // namespace

void begin_joints(World& world, StepContext& context) {
  JointStage& joints = context.joints;
  joints.from_outside = {};
  const RigidBodies& rigid = world.bodies.rigid;
  joints.solver.update(world.bodies.articulation, rigid);
  joints.response.outdate();
  if (world.has(Effect::pd_control))
    joints.solver.plan_control(world.bodies.articulation, rigid, context.time, context.dt,
                               world.last_step.control_angle);
  context.end_pose.resize(rigid.size());
  for (std::size_t i = 0; i < rigid.size(); ++i) context.end_pose[i] = rigid.state[i].pose;
  for (const KinematicStep& step : context.kinematic) context.end_pose[step.body] = step.end.pose;
}

bool joints_turn_too_far(const World& world, const StepContext& context) {
  const bool in_contact =
      world.touches() && count_active(context.contact.contacts, context.contact.graph) > 0;
  const double most = context.joints.solver.fits() ? turns_on : in_contact ? min_whip : min_turn;
  return context.dt * fastest_turn(context, world.bodies.rigid.state) > most * world.settings.max_rotation;
}

bool joints_miss_energy(const World& world, const StepContext& context) {
  if (!(context.joints.excess > max_excess)) return false;
  const double rate = std::max(fastest_turn(context, context.states.rigid_n),
                               fastest_turn(context, world.bodies.rigid.state));
  return rate > min_turn * world.settings.max_rotation / context.dt;
}

// Interpenetration resolution has moved bodies one by one; joints are assembled again here. The velocities
// become v^^n plus the impulses of joints that made x^{n+1} fit. These belong to v^{n+1} as well, as in
// RATTLE (Andersen 1983); without them a pendulum loses energy in proportion to the step.
void finish_positions(World& world, StepContext& context) {
  JointStage& joints = context.joints;
  RigidBodies& rigid = world.bodies.rigid;
  Momentum from_outside;
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    RigidState& state = rigid.state[i];
    if (rigid.properties[i].is_dynamic()) {
      state.velocity += rigid.properties[i].inverse_mass * joints.push[i];
      state.angular_momentum += joints.turn[i];
    } else {  // the impulses on fixed bodies acted at x^n
      const Vec3& place = context.states.rigid_n[i].pose.position;
      from_outside += {-joints.push[i], -place.cross(joints.push[i]) - joints.turn[i]};
    }
  }
  if (world.has(Effect::push_out) || !joints.solver.fits()) {
    const double gap = joints.solver.assemble(world.bodies.articulation, rigid);
    if (!(gap <= joined)) fail(world, gap);
  }
  for (std::size_t i = 0; i < rigid.size(); ++i)
    update_orientation_dependents(rigid.state[i], rigid.properties[i]);
  joints.solver.update(world.bodies.articulation, rigid);
  joints.response.outdate();
  joints.solver.stabilize(rigid);
  joints.from_outside = from_outside;
  joints.from_outside += {joints.solver.from_outside().linear, joints.solver.from_outside().angular};
  joints.excess = 0;
  if (world.settings.orientation != OrientationUpdate::exact) return;
  const FreeMotion::Outcome outcome = joints.free_motion.finish(joints.solver, rigid);
  joints.excess = outcome.excess;
  joints.from_outside += {outcome.outside.linear, outcome.outside.angular};
}

}  // namespace duet
