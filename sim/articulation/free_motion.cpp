#include "sim/articulation/free_motion.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/base/assert.h"
#include "sim/base/dense_solvers.h"
#include "sim/base/disjoint_sets.h"

namespace duet {
namespace {

// A row depends on the rows before it if their span leaves less than this fraction of its square. It is far
// above rounding and far below the value of independent rows.
constexpr double dependent = 1e-10;
// Bound of |s - 1|, so that motion near a turning point is neither stopped nor doubled. Steps that need a
// fifth of it are refused if they can be (sim/step/articulate.cpp).
constexpr double max_change = 0.05;
// Least internal energy, as a fraction of the whole, that an energy error is compared with. Without it,
// groups that hardly move within themselves would report large relative errors, and steps would be refused
// for them.
constexpr double min_internal = 0.005;

// Returns the inertia tensor in world axes (kg m^2) times `w`.
Vec3 times_inertia(const RigidState& state, const RigidProperties& properties, const Vec3& w) {
  const Quat& q = state.pose.orientation;
  return q * properties.inertia.cwiseProduct(q.conjugate() * w);
}

// Constraint rows a_i on the twist (v, w) of a rigid body, together with M^-1 a_i, made orthonormal in the
// inverse mass: a_i . M^-1 a_j = 1 if i = j, else 0.
class ForbiddenTwists {
 public:
  ForbiddenTwists(double mass, const Mat3& inverse_inertia)
      : mass_(mass), inverse_inertia_(inverse_inertia) {}

  // Adds the row linear . v + angular . w, unless it depends on the rows before it.
  void add(const Vec3& linear, const Vec3& angular) {
    if (count_ == twists_.size()) return;
    Twist t{linear, angular, linear / mass_, inverse_inertia_ * angular};
    const double whole = linear.dot(t.v) + angular.dot(t.w);
    for (std::size_t k = 0; k < count_; ++k) {
      const Twist& other = twists_[k];
      const double along = other.linear.dot(t.v) + other.angular.dot(t.w);
      t.linear -= along * other.linear;
      t.angular -= along * other.angular;
      t.v -= along * other.v;
      t.w -= along * other.w;
    }
    const double left = t.linear.dot(t.v) + t.angular.dot(t.w);
    if (!(left > dependent * whole)) return;
    const double scale = 1 / std::sqrt(left);
    twists_[count_++] = {scale * t.linear, scale * t.angular, scale * t.v, scale * t.w};
  }

  // Projects a twist onto those for which all rows vanish, orthogonally in the mass metric.
  void remove_from(Vec3& v, Vec3& w) const {
    for (std::size_t k = 0; k < count_; ++k) {
      const Twist& t = twists_[k];
      const double along = t.linear.dot(v) + t.angular.dot(w);
      v -= along * t.v;
      w -= along * t.w;
    }
  }

 private:
  struct Twist {
    Vec3 linear, angular,  // a_i
        v, w;              // M^-1 a_i
  };
  double mass_;
  Mat3 inverse_inertia_;
  std::array<Twist, 6> twists_;
  std::size_t count_ = 0;
};

}  // namespace

void FreeMotion::analyze(const Articulation& articulation, const RigidBodies& rigid) {
  *this = FreeMotion();
  const auto is_dynamic = [&](int body) {
    return rigid.properties[static_cast<std::size_t>(body)].is_dynamic();
  };
  DisjointSets jointed(rigid.size());
  std::vector<char> has_joint(rigid.size(), 0);
  for (const Joint& joint : articulation.joints) {
    has_joint[as_index(joint.parent)] = has_joint[as_index(joint.child)] = 1;
    if (is_dynamic(joint.parent) && is_dynamic(joint.child)) jointed.join(joint.parent, joint.child);
  }
  std::vector<std::size_t> group_of(rigid.size(), rigid.size());
  for (std::size_t body = 0; body < rigid.size(); ++body) {
    if (!has_joint[body]) continue;
    bodies_.push_back(body);
    if (!rigid.properties[body].is_dynamic()) continue;
    std::size_t& group = group_of[as_index(jointed.first(static_cast<int>(body)))];
    if (group == rigid.size()) {
      group = groups_.size();
      groups_.emplace_back();
    }
    groups_[group].members.push_back(body);
  }
  for (std::size_t j = 0; j < articulation.joints.size(); ++j) {
    const Joint& joint = articulation.joints[j];
    if (is_dynamic(joint.parent) == is_dynamic(joint.child)) continue;
    const int body = is_dynamic(joint.parent) ? joint.parent : joint.child;
    groups_[group_of[as_index(jointed.first(body))]].fixed_joints.push_back(j);
    any_fixed_ = true;
  }
  for (std::vector<Vec3>* values : {&linear_, &angular_, &fall_, &fall_turn_, &path_linear_, &path_momentum_})
    values->assign(rigid.size(), Vec3::Zero());
  start_.resize(rigid.size());
}

double FreeMotion::kinetic(const RigidBodies& rigid, const Group& group, const std::vector<Vec3>& linear,
                           const std::vector<Vec3>& angular) const {
  double energy = 0;
  for (const std::size_t i : group.members) {
    const Vec3 moment = times_inertia(rigid.state[i], rigid.properties[i], angular[i]);
    energy += (rigid.properties[i].mass * linear[i].squaredNorm() + angular[i].dot(moment)) / 2;
  }
  return energy;
}

double FreeMotion::weight_power(const RigidBodies& rigid, const Group& group,
                                const std::vector<Vec3>& linear) const {
  double power = 0;
  for (const std::size_t i : group.members) power += rigid.properties[i].mass * gravity_.dot(linear[i]);
  return power;
}

void FreeMotion::project(JointSolver& joints, const RigidBodies& rigid) {
  joints.prepare_projection(rigid);
  joints.project(rigid, linear_, angular_);
  if (!any_fixed_ || gravity_.isZero(0)) return;
  for (const std::size_t i : bodies_) {
    fall_[i] = rigid.properties[i].is_dynamic() ? gravity_ : Vec3(Vec3::Zero());
    fall_turn_[i].setZero();
  }
  joints.project(rigid, fall_, fall_turn_);
}

// W = dt m g . v* - (dt/2) m g . (u - dt/4 P g) - (dt/2) m g . (u'' + dt/4 P' g), where P and P' project
// accelerations onto those that the joints allow at x^n and at x^{n+1}. Gravity acts by m g dt/2 at x^n,
// where it takes velocities to u, and again at x^{n+1}, where it finds u''; the last two terms are its work
// there, and the first one is its work along the path. W vanishes if all bodies are free. The terms of x^n
// are added here.
void FreeMotion::begin(JointSolver& joints, const RigidBodies& rigid, const Vec3& gravity, double dt) {
  DUET_ASSERT(start_.size() == rigid.size() && dt > 0);
  gravity_ = gravity;
  dt_ = dt;
  for (const std::size_t i : bodies_) {
    const RigidState& state = rigid.state[i];
    linear_[i] = path_linear_[i] = state.velocity;
    angular_[i] = state.angular_velocity;
    path_momentum_[i] = state.angular_momentum;
    start_[i] = state.pose;
  }
  project(joints, rigid);
  for (Group& group : groups_) {
    group.energy = kinetic(rigid, group, linear_, angular_);
    if (!group.is_fixed()) continue;
    group.energy += dt * weight_power(rigid, group, path_linear_) -
                    dt / 2 * weight_power(rigid, group, linear_) +
                    dt * dt / 8 * weight_power(rigid, group, fall_);
  }
}

FreeMotion::Outcome FreeMotion::finish(JointSolver& joints, RigidBodies& rigid) {
  DUET_ASSERT(start_.size() == rigid.size());
  for (const std::size_t i : bodies_) {
    const RigidState& state = rigid.state[i];
    const bool is_dynamic = rigid.properties[i].is_dynamic();
    linear_[i] = is_dynamic ? path_linear_[i] : state.velocity;
    angular_[i] = is_dynamic ? Vec3(state.inverse_inertia * path_momentum_[i]) : state.angular_velocity;
  }
  project(joints, rigid);
  Outcome outcome;
  for (const Group& group : groups_)
    if (!held_by_motion(joints, rigid, group))
      outcome.excess = std::max(outcome.excess, correct(joints, rigid, group, outcome.outside));
  return outcome;
}

// A kinematic body counts as moving if it has a velocity now or has moved in the step.
bool FreeMotion::held_by_motion(const JointSolver& joints, const RigidBodies& rigid,
                                const Group& group) const {
  return std::any_of(group.fixed_joints.begin(), group.fixed_joints.end(), [&](std::size_t j) {
    const std::size_t i =
        rigid.properties[joints.parent(j)].is_dynamic() ? joints.child(j) : joints.parent(j);
    const RigidState& state = rigid.state[i];
    return !(state.velocity.isZero(0) && state.angular_velocity.isZero(0) &&
             state.pose.position == start_[i].position &&
             state.pose.orientation.coeffs() == start_[i].orientation.coeffs());
  });
}

// r is the projection, orthogonal in the mass metric, of u' onto the rigid motions whose momentum is kept.
// These are the motions that joints with fixed bodies allow. If gravity pulls at a group with such joints,
// only turns about the vertical and horizontal travel remain.
FreeMotion::Rigid FreeMotion::rigid_motion(const JointSolver& joints, const RigidBodies& rigid,
                                           const Group& group) const {
  Rigid motion;
  Vec3 angular = Vec3::Zero();
  Mat3 inertia = Mat3::Zero();
  for (const std::size_t i : group.members) {
    const double m = rigid.properties[i].mass;
    motion.mass += m;
    motion.center += m * rigid.state[i].pose.position;
    motion.v += m * linear_[i];
  }
  motion.center /= motion.mass;
  motion.v /= motion.mass;
  for (const std::size_t i : group.members) {
    const RigidProperties& properties = rigid.properties[i];
    const Vec3 arm = rigid.state[i].pose.position - motion.center;
    const Mat3 axes = rigid.state[i].pose.orientation.toRotationMatrix();
    inertia += axes * properties.inertia.asDiagonal() * axes.transpose() +
               properties.mass * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
    angular += times_inertia(rigid.state[i], properties, angular_[i]) +
               properties.mass * arm.cross(linear_[i] - motion.v);
  }
  const Mat3 inverse_inertia = SymmetricFactor<3>(inertia).inverse();
  motion.w = inverse_inertia * angular;
  if (!group.is_fixed()) return motion;

  ForbiddenTwists forbidden(motion.mass, inverse_inertia);
  for (const std::size_t j : group.fixed_joints)
    for (const JointRow& row : joints.rows(j)) {
      if (row.role != RowRole::structure) continue;
      const bool is_child = rigid.properties[joints.child(j)].is_dynamic();
      const std::size_t body = is_child ? joints.child(j) : joints.parent(j);
      const Vec3 arm = rigid.state[body].pose.position - motion.center;
      forbidden.add(row.linear, arm.cross(row.linear) + (is_child ? row.child_moment : row.parent_moment));
    }
  if (!gravity_.isZero(0)) {
    forbidden.add(gravity_, Vec3::Zero());
    for (int axis = 0; axis < 3; ++axis) forbidden.add(Vec3::Zero(), gravity_.cross(Vec3::Unit(axis)));
  }
  forbidden.remove_from(motion.v, motion.w);
  return motion;
}

// Solves K s^2 + B s = K + B - E for s, with K = K(u' - r) and B = (dt/2) m g . (u' - r), the change of W
// with s. In the code `internal` is K, `power` B (r has no velocity along g), `excess` E, and `change`
// s - 1. If the equation has no root, s - 1 is taken as -E / K, before the bound of its size.
double FreeMotion::correct(const JointSolver& joints, RigidBodies& rigid, const Group& group,
                           JointSolver::Outside& outside) {
  double energy = kinetic(rigid, group, linear_, angular_), excess = energy - group.energy;
  double power = 0, kick = 0;
  if (group.is_fixed()) {
    power = dt_ / 2 * weight_power(rigid, group, linear_);
    kick = dt_ * dt_ / 8 * weight_power(rigid, group, fall_);
    excess += power + kick;
  }
  const Rigid motion = rigid_motion(joints, rigid, group);
  if (!group.is_fixed()) energy -= motion.mass * motion.v.squaredNorm() / 2;
  for (const std::size_t i : group.members) {
    linear_[i] -= motion.v + motion.w.cross(rigid.state[i].pose.position - motion.center);
    angular_[i] -= motion.w;
  }
  const double internal = kinetic(rigid, group, linear_, angular_);
  if (excess == 0 || !(internal > 0)) return 0;
  const double slope = 2 * internal + power, square = slope * slope - 4 * internal * excess;
  const double wanted =
      slope > 0 && square >= 0 ? -2 * excess / (slope + std::sqrt(square)) : -excess / internal;
  const double change = std::clamp(wanted, -max_change, max_change);
  for (const std::size_t i : group.members) {
    RigidState& state = rigid.state[i];
    const Vec3 impulse = rigid.properties[i].mass * change * linear_[i],
               moment = times_inertia(state, rigid.properties[i], change * angular_[i]);
    state.velocity += change * linear_[i];
    state.angular_velocity += change * angular_[i];
    state.angular_momentum += moment;
    if (!group.is_fixed()) continue;
    outside.linear += impulse;
    outside.angular += state.pose.position.cross(impulse) + moment;
  }
  return std::abs(excess) / (4 * kick + std::max(internal, min_internal * energy));
}

}  // namespace duet
