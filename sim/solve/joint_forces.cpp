#include "sim/solve/joint_forces.h"

#include <algorithm>

#include "sim/base/assert.h"

namespace duet {
namespace {

// Stiffness of a row over the mass that it moves by itself, as for contacts (contact_forces.cpp).
constexpr double drive_stiffness = 100;
// Least mass of a rigid body in the choice of stiffness, over that of the heaviest body on its island, as for
// contacts.
constexpr double lightest_share = 0.1;

}  // namespace

void JointForces::build(const RigidBodies& rigid, const std::vector<DriveRow>& rows, const Islands& islands,
                        const std::vector<double>& heaviest, const std::vector<double>& impulses,
                        double factor) {
  DUET_ASSERT(factor >= 0 && heaviest.size() == islands.size());
  rigid_ = &rigid;
  rows_.clear();
  for (const DriveRow& joint : rows) {
    if (!islands.is_searched_rigid(joint.parent) && !islands.is_searched_rigid(joint.child)) continue;
    const auto response = [&](std::size_t body, const Vec3& moment) {
      const RigidProperties& properties = rigid.properties[body];
      if (!properties.is_dynamic()) return 0.0;
      const double least = lightest_share * heaviest[as_index(islands.of_rigid(body))];
      return std::min(1.0, properties.mass / least) *
             (properties.inverse_mass * joint.geometry.linear.squaredNorm() +
              moment.dot(rigid.state[body].inverse_inertia * moment));
    };
    const double moved = response(joint.parent, joint.geometry.parent_moment) +
                         response(joint.child, joint.geometry.child_moment);
    if (!(moved > 0)) continue;
    Row row{.joint = joint, .stiffness = drive_stiffness / moved};
    row.multiplier = row.impulse =
        std::clamp(factor * impulses[joint.row], joint.bounds.least, joint.bounds.most);
    rows_.push_back(row);
  }
}

double JointForces::velocity_of(const Row& row, const GeneralizedVelocity& v) {
  const DriveRow& joint = row.joint;
  return joint.geometry.linear.dot(v.linear[joint.child] - v.linear[joint.parent]) +
         joint.geometry.child_moment.dot(v.angular[joint.child]) -
         joint.geometry.parent_moment.dot(v.angular[joint.parent]);
}

double JointForces::evaluate(const GeneralizedVelocity& velocity) {
  double potential = 0;
  for (Row& row : rows_) {
    const double wanted = row.multiplier + row.stiffness * (row.joint.target - velocity_of(row, velocity));
    row.impulse = std::clamp(wanted, row.joint.bounds.least, row.joint.bounds.most);
    row.slope = row.impulse == wanted ? row.stiffness : 0;
    const double beyond = wanted - row.impulse;
    potential += (wanted * wanted - beyond * beyond - row.multiplier * row.multiplier) / (2 * row.stiffness);
  }
  return potential;
}

void JointForces::push(const Row& row, double impulse, GeneralizedVelocity& v) const {
  const auto give = [&](std::size_t body, const Vec3& linear, const Vec3& angular) {
    if (!rigid_->properties[body].is_dynamic()) return;
    v.linear[body] += rigid_->properties[body].inverse_mass * linear;
    v.angular[body] += rigid_->state[body].inverse_inertia * angular;
  };
  const JointRow& geometry = row.joint.geometry;
  give(row.joint.child, impulse * geometry.linear, impulse * geometry.child_moment);
  give(row.joint.parent, -impulse * geometry.linear, -impulse * geometry.parent_moment);
}

void JointForces::add_velocities(double factor, GeneralizedVelocity& out) const {
  for (const Row& row : rows_)
    if (row.impulse != 0) push(row, factor * row.impulse, out);
}

void JointForces::add_differentials(const GeneralizedVelocity& change, GeneralizedVelocity& out) const {
  for (const Row& row : rows_)
    if (row.slope > 0) push(row, row.slope * velocity_of(row, change), out);
}

void JointForces::add_blocks(std::vector<Mat6>& rigid) const {
  for (const Row& row : rows_) {
    if (row.slope == 0) continue;
    const auto add = [&](std::size_t body, const Vec3& moment) {
      if (!rigid_->properties[body].is_dynamic()) return;
      Vec6 direction;
      direction << row.joint.geometry.linear, moment;
      rigid[body] += row.slope * direction * direction.transpose();
    };
    add(row.joint.child, row.joint.geometry.child_moment);
    add(row.joint.parent, row.joint.geometry.parent_moment);
  }
}

// The one component of a row's velocity is the first one of the map.
void JointForces::append_rows(std::vector<ResponseRow>& rows) const {
  using Of = ResponseRow::Of;
  const auto along = [](const Vec3& direction) {
    Mat3 map = Mat3::Zero();
    map.row(0) = direction.transpose();
    return map;
  };
  for (const Row& row : rows_) {
    if (row.slope == 0) continue;
    ResponseRow& out = rows.emplace_back();
    out.slope(0, 0) = row.slope;
    const JointRow& geometry = row.joint.geometry;
    const int child = static_cast<int>(row.joint.child), parent = static_cast<int>(row.joint.parent);
    out.add(Of::linear, child, along(geometry.linear));
    out.add(Of::angular, child, along(geometry.child_moment));
    out.add(Of::linear, parent, along(-geometry.linear));
    out.add(Of::angular, parent, along(-geometry.parent_moment));
  }
}

void JointForces::update_multipliers() {
  for (Row& row : rows_) row.multiplier = row.impulse;
}

void JointForces::give_impulses(std::vector<double>& impulse, std::vector<double>& swept) const {
  for (const Row& row : rows_) {
    impulse[row.joint.row] = row.impulse;
    swept[row.joint.row] = 0;
  }
}

void JointForces::hand_to(JointSolver& joints) const {
  for (const Row& row : rows_) joints.start_drive(row.joint.row, row.impulse);
}

Momentum JointForces::impulse_of_fixed(const Row& row) const {
  Momentum total;
  const auto add = [&](std::size_t body, const Vec3& linear, const Vec3& angular) {
    if (rigid_->properties[body].is_dynamic()) return;
    total += {-linear, -(rigid_->state[body].pose.position.cross(linear) + angular)};
  };
  const JointRow& geometry = row.joint.geometry;
  add(row.joint.child, row.impulse * geometry.linear, row.impulse * geometry.child_moment);
  add(row.joint.parent, -row.impulse * geometry.linear, -row.impulse * geometry.parent_moment);
  return total;
}

Momentum JointForces::impulse_of_fixed() const {
  Momentum total;
  for (const Row& row : rows_) total += impulse_of_fixed(row);
  return total;
}

Momentum JointForces::impulse_of_fixed(std::size_t parent, std::size_t child) const {
  Momentum total;
  for (const Row& row : rows_)
    if (row.joint.parent == parent && row.joint.child == child) total += impulse_of_fixed(row);
  return total;
}

}  // namespace duet
