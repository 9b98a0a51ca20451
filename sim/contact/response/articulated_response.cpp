#include "sim/contact/response/articulated_response.h"

#include <algorithm>
#include <cmath>

#include "sim/base/disjoint_sets.h"

namespace duet {
namespace {

// Returns the map (1, -[arm]x) from a twist (v, w) to the velocity at `arm`: v + w x arm.
Eigen::Matrix<double, 3, 6> velocity_at(const Vec3& arm) {
  Eigen::Matrix<double, 3, 6> map;
  map << Mat3::Identity(), -skew(arm);
  return map;
}

}  // namespace

std::vector<int> linked_bodies(const Bodies& bodies, std::size_t largest) {
  DisjointSets groups(bodies.rigid.size());
  const int count = static_cast<int>(groups.size());
  const auto is_dynamic = [&](int body) { return bodies.rigid.properties[as_index(body)].is_dynamic(); };
  for (const Joint& joint : bodies.articulation.joints) {
    if (is_dynamic(joint.parent) && is_dynamic(joint.child)) groups.join(joint.parent, joint.child);
  }
  std::vector<std::size_t> members(groups.size(), 0);
  std::vector<char> jointed(groups.size(), 0);
  for (int body = 0; body < count; ++body) ++members[as_index(groups.first(body))];
  for (const Joint& joint : bodies.articulation.joints)
    for (const int body : {joint.parent, joint.child})
      if (is_dynamic(body)) jointed[as_index(body)] = 1;
  std::vector<int> linked(groups.size(), -1);
  for (int body = 0; body < count; ++body)
    if (jointed[as_index(body)] != 0 && members[as_index(groups.first(body))] <= largest)
      linked[as_index(body)] = groups.first(body);
  return linked;
}

bool ArticulatedResponse::is_complete() const {
  return others_.empty() && std::none_of(groups_.begin(), groups_.end(),
                                         [](const Group& group) { return group.is_ill_conditioned; });
}

void ArticulatedResponse::find_groups(const Bodies& bodies) {
  const std::size_t count = bodies.rigid.size();
  group_of_.assign(count, -1);
  member_.resize(count);
  for (std::size_t body = 0; body < count; ++body) {
    const LevelSet& shape = bodies.rigid.properties[body].shape;
    member_[body].arm = (shape.upper() - shape.lower()).norm() / 2;
    const int first = bodies.linked[body];
    if (first < 0) continue;
    if (as_index(first) == body) {
      group_of_[body] = static_cast<int>(groups_.size());
      groups_.emplace_back();
    } else {
      group_of_[body] = group_of_[as_index(first)];
    }
    Group& group = groups_[as_index(group_of_[body])];
    member_[body].place = group.members.size();
    group.mass += bodies.rigid.properties[body].mass;
    group.members.push_back(body);
  }
  for (const Joint& joint : bodies.articulation.joints)
    for (const int body : {joint.parent, joint.child})
      if (bodies.rigid.properties[as_index(body)].is_dynamic() && !contains(body))
        others_.push_back(as_index(body));
  for (Group& group : groups_) {
    const auto size = static_cast<Eigen::Index>(6 * group.members.size());
    group.response.resize(size, size);
  }
}

// Finds the columns of the responses: projects the twists of unit wrenches onto those that the joints allow.
// One projection serves one column of every group, because joints do not connect groups.
void ArticulatedResponse::respond(const RigidBodies& rigid, const JointSolver& joints) {
  std::size_t most = 0;
  for (const Group& group : groups_) most = std::max(most, group.members.size());
  for (std::size_t place = 0; place < most; ++place)
    for (Eigen::Index axis = 0; axis < 6; ++axis) {
      linear_.assign(rigid.size(), Vec3::Zero());
      angular_.assign(rigid.size(), Vec3::Zero());
      for (const Group& group : groups_) {
        if (place >= group.members.size()) continue;
        const std::size_t body = group.members[place];
        if (axis < 3)
          linear_[body][axis] = rigid.properties[body].inverse_mass;
        else
          angular_[body] = rigid.state[body].inverse_inertia.col(axis - 3);
      }
      joints.project(rigid, linear_, angular_);
      for (Group& group : groups_) {
        if (place >= group.members.size()) continue;
        const Eigen::Index column = 6 * static_cast<Eigen::Index>(place) + axis;
        for (std::size_t i = 0; i < group.members.size(); ++i) {
          const Eigen::Index row = 6 * static_cast<Eigen::Index>(i);
          group.response.block<3, 1>(row, column) = linear_[group.members[i]];
          group.response.block<3, 1>(row + 3, column) = angular_[group.members[i]];
        }
      }
    }
}

Mat6 ArticulatedResponse::response_of(int body, int is_hit) const {
  const int group = group_of_[as_index(body)];
  if (group_of_[as_index(is_hit)] != group) return Mat6::Zero();
  return groups_[as_index(group)].response.block<6, 6>(first_row(as_index(body)),
                                                       first_row(as_index(is_hit)));
}

Mat3 ArticulatedResponse::factor(const ContactPoint& contact, const Bodies& bodies) const {
  const RigidBodies& rigid = bodies.rigid;
  const auto of_body = [&](int body, const Vec3& arm) -> Mat3 {
    if (!contains(body))
      return impulse_factor(rigid.state[as_index(body)], rigid.properties[as_index(body)].inverse_mass, arm);
    const auto map = velocity_at(arm);
    return map * response_of(body, body) * map.transpose();
  };
  Mat3 K = Mat3::Zero();
  if (moves_host(bodies, contact)) K = of_body(contact.host, contact.host_arm);
  if (!contact.is_rigid_pair()) {
    K.diagonal().array() += surface_point(bodies, contact).inverse_mass;
    return K;
  }
  K += of_body(contact.guest_rigid, contact.guest_arm);
  if (contains(contact.host) && contains(contact.guest_rigid)) {
    const Mat3 across = velocity_at(contact.host_arm) * response_of(contact.host, contact.guest_rigid) *
                        velocity_at(contact.guest_arm).transpose();
    K -= across + across.transpose();
  }
  return K;
}

ContactResponse ArticulatedResponse::response(const ContactPoint& contact, const Bodies& bodies) const {
  // Smallest motion along the normal, as a fraction of that of separate bodies, that is taken for more than
  // rounding.
  constexpr double min_share = 1e-6;
  // Fraction of the response of separate bodies that is added to K. Joints can leave a contact one direction
  // of motion, as that of a door, and K alone would have no inverse. A larger value would let contact bend
  // the joints more.
  constexpr double softness = 1e-9;
  const Mat3 K = factor(contact, bodies);
  const Vec3& n = contact.normal;
  if (!(n.dot(K * n) > min_share * n.dot(contact.response.K * n))) return {};
  return {K + softness * contact.response.K, n};
}

// Near a joint, or where a group is folded flat, small velocities of a contact are large velocities of the
// bodies: the contact responds like a mass far heavier than all that moves.
void ArticulatedResponse::mark_ill_conditioned(const ContactPoint& contact, const ContactResponse& answer,
                                               const Bodies& bodies) {
  // Largest effective mass of a contact over the mass of the bodies that it moves. A larger value would let
  // loops that fold flat gain energy.
  constexpr double max_masses = 50;
  double mass = 0;
  const auto count = [&](int body) {
    const auto b = as_index(body);
    if (contains(body))
      mass += groups_[as_index(group_of_[b])].mass;
    else if (bodies.rigid.properties[b].is_dynamic())
      mass += bodies.rigid.properties[b].mass;
  };
  if (moves_host(bodies, contact)) count(contact.host);
  if (contact.is_rigid_pair())
    count(contact.guest_rigid);
  else if (const double inverse = surface_point(bodies, contact).inverse_mass; inverse > 0)
    mass += 1 / inverse;
  if (answer.normal_mass <= max_masses * mass) return;
  for (const int body : {contact.host, contact.guest_rigid})
    if (body >= 0 && contains(body)) groups_[as_index(group_of_[as_index(body)])].is_ill_conditioned = true;
}

void ArticulatedResponse::update(const Bodies& bodies, JointSolver& joints, ControlledJoints controlled) {
  const std::vector<Joint>& all = bodies.articulation.joints;
  if (controlled == ControlledJoints::are_held_with_limits) {
    // The next call computes the response anew.
    is_current_ = false;
    joints.prepare_limited_projection(bodies.articulation, bodies.rigid);
    respond(bodies.rigid, joints);
    return;
  }
  const bool control =
      controlled == ControlledJoints::are_held &&
      std::any_of(all.begin(), all.end(), [](const Joint& joint) { return joint.control.on; });
  if (is_current_ && control == has_control_) return;
  is_current_ = true;
  has_control_ = control;
  if (control)
    joints.prepare_controlled_projection(bodies.articulation, bodies.rigid);
  else
    joints.prepare_projection(bodies.rigid);
  respond(bodies.rigid, joints);
  for (const Group& group : groups_)
    for (const std::size_t body : group.members) {
      const Mat3 rotation = bodies.rigid.state[body].pose.orientation.toRotationMatrix();
      member_[body].inertia =
          rotation * bodies.rigid.properties[body].inertia.asDiagonal() * rotation.transpose();
    }
}

ArticulatedResponse* ArticulatedResponse::prepare(const Bodies& bodies, JointSolver& joints,
                                                  ControlledJoints controlled, ContactSet& contacts) {
  is_used_ = false;
  if (bodies.linked.empty()) return nullptr;
  if (group_of_.empty()) find_groups(bodies);
  for (Group& group : groups_) group.is_ill_conditioned = false;
  const auto takes = [&](const ContactPoint& contact) { return takes_part(contact); };
  if (std::none_of(contacts.points.begin(), contacts.points.end(), takes)) return nullptr;
  update(bodies, joints, controlled);
  own_.resize(contacts.points.size());
  for (std::size_t i = 0; i < own_.size(); ++i) own_[i] = contacts.points[i].response;
  answer(bodies, contacts);
  for (const ContactPoint& contact : contacts.points)
    if (takes_part(contact)) mark_ill_conditioned(contact, contact.response, bodies);
  if (!is_complete()) answer(bodies, contacts);
  is_used_ = true;
  return this;
}

void ArticulatedResponse::release(ContactSet& contacts) const {
  for (std::size_t i = 0; i < own_.size(); ++i) contacts.points[i].response = own_[i];
}

void ArticulatedResponse::answer(const Bodies& bodies, ContactSet& contacts) const {
  for (std::size_t i = 0; i < own_.size(); ++i) {
    ContactPoint& contact = contacts.points[i];
    contact.response = own_[i];
    if (takes_part(contact)) contact.response = response(contact, bodies);
  }
}

const ArticulatedResponse* ArticulatedResponse::prepare(const Bodies& bodies, JointSolver& joints,
                                                        const ContactCache& cache) {
  is_used_ = false;
  if (bodies.linked.empty()) return nullptr;
  if (group_of_.empty()) find_groups(bodies);
  for (Group& group : groups_) group.is_ill_conditioned = false;
  const auto takes = [&](const CachedContact& contact) {
    return contains(contact.host) || (contact.guest_rigid >= 0 && contains(contact.guest_rigid));
  };
  if (std::none_of(cache.begin(), cache.end(), takes)) return nullptr;
  update(bodies, joints, ControlledJoints::are_free);
  ContactPoint contact;
  for (const CachedContact& remembered : cache) {
    if (!takes(remembered)) continue;
    contact.host = remembered.host;
    contact.guest_rigid = remembered.guest_rigid;
    contact.feature = remembered.feature;
    contact.edge = remembered.edge;
    if (contact.is_on_edge() && !contact.is_rigid_pair()) put_on_surface(bodies, contact);
    update_geometry(bodies, contact);
    mark_ill_conditioned(contact, response(contact, bodies), bodies);
  }
  is_used_ = true;
  return this;
}

void ArticulatedResponse::begin(const RigidBodies& rigid) {
  for (const Group& group : groups_)
    for (const std::size_t body : group.members) {
      member_[body].start = rigid.state[body];
      member_[body].linear.setZero();
      member_[body].angular.setZero();
    }
}

void ArticulatedResponse::push(RigidBodies& rigid, int body, const Vec6& wrench) {
  Member& is_hit = member_[as_index(body)];
  is_hit.linear += wrench.head<3>();
  is_hit.angular += wrench.tail<3>();
  for_each_change(body, wrench, [&](std::size_t moved, const Vec6& change) {
    RigidState& state = rigid.state[moved];
    state.velocity += change.head<3>();
    state.angular_velocity += change.tail<3>();
    state.angular_momentum += member_[moved].inertia * change.tail<3>();
  });
}

void ArticulatedResponse::push(int body, const Vec6& wrench, std::vector<Vec3>& linear,
                               std::vector<Vec3>& angular) const {
  for_each_change(body, wrench, [&](std::size_t moved, const Vec6& change) {
    linear[moved] += change.head<3>();
    angular[moved] += change.tail<3>();
  });
}

void ArticulatedResponse::apply_impulse(Bodies& bodies, const ContactPoint& contact, const Vec3& impulse) {
  const auto give = [&](int body, const Vec3& arm, const Vec3& j) {
    if (contains(body))
      push(bodies.rigid, body, wrench_of(arm, j));
    else
      duet::apply_impulse(bodies.rigid.state[as_index(body)], bodies.rigid.properties[as_index(body)], arm,
                          j);
  };
  if (contact.is_rigid_pair())
    give(contact.guest_rigid, contact.guest_arm, impulse);
  else
    duet::apply_impulse(surface_point(bodies, contact), impulse, bodies.particles);
  if (moves_host(bodies, contact)) give(contact.host, contact.host_arm, -impulse);
}

void ArticulatedResponse::finish(RigidBodies& rigid) {
  for (const Group& group : groups_)
    for (const std::size_t body : group.members) {
      Member& member = member_[body];
      RigidState& state = rigid.state[body];
      member.end = state;
      if (group.is_ill_conditioned) continue;  // impulses have moved its members as separate bodies
      state.velocity = member.start.velocity + rigid.properties[body].inverse_mass * member.linear;
      state.angular_momentum = member.start.angular_momentum + member.angular;
      state.angular_velocity = member.start.angular_velocity + state.inverse_inertia * member.angular;
    }
  for (const std::size_t body : others_) member_[body].end = rigid.state[body];
}

double ArticulatedResponse::difference(const RigidBodies& rigid) const {
  double largest = 0;
  const auto compare = [&](std::size_t body) {
    const RigidState &state = rigid.state[body], &end = member_[body].end;
    largest =
        std::max(largest, (state.velocity - end.velocity).norm() +
                              member_[body].arm * (state.angular_velocity - end.angular_velocity).norm());
  };
  for (const Group& group : groups_) std::for_each(group.members.begin(), group.members.end(), compare);
  std::for_each(others_.begin(), others_.end(), compare);
  return largest;
}

}  // namespace duet
