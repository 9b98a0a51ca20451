// The rows of control, friction and limits of joints as a velocity solve takes them, and what it gives back.
#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/articulation/joint_solver.h"

namespace duet {
namespace {

constexpr double unbounded = std::numeric_limits<double>::infinity();
// A limit counts as reached if less than this slack is left, m or rad. It is far above the error that joint
// solves leave of positions (1e-11); a larger value would stop joints visibly before their limits.
constexpr double at_limit = 1e-9;
// Time in which a violated limit is approached again, s. A violation as fast as the step allows would be
// removed at a velocity that grows as steps become shorter, and throw the bodies.
constexpr double limit_return = 0.1;

}  // namespace

Bounds JointSolver::drive_bounds(const Joint& joint, RowRole role, double seconds) {
  if (role == RowRole::limit) return {0, unbounded};
  const double most = (role == RowRole::control ? joint.control.most : joint.friction) * seconds;
  return {-most, most};
}

double JointSolver::halfway_limit(std::size_t r) const {
  return rows_[r].role == RowRole::limit ? std::max(0.0, rows_[r].side * halfway_[r]) : 0;
}

double JointSolver::limit_rate(double slack, double dt) {
  return -slack / (slack < 0 ? std::max(dt, limit_return) : dt);
}

// A limit that has acted in pre_stabilize() acts at the end as well if IV.2 or rounding has left it some
// slack. Otherwise nothing would stop the velocities at the end, which would grow by the forces of every
// step while the positions rest.
double JointSolver::end_rate(std::size_t r, double slack) const {
  if (slack <= at_limit) return 0;
  return halfway_limit(r) > 0 ? -slack / dt_ : -unbounded;
}

void JointSolver::start_limits() {
  for_each_row([&](std::size_t, std::size_t r) {
    const double impulse = halfway_limit(r);
    if (impulse > 0) start_drive(r, impulse);
  });
}

std::vector<double> starting_angles(const Articulation& articulation, const RigidBodies& rigid) {
  std::vector<double> angles;
  const std::vector<Joint>& joints = articulation.joints;
  if (std::none_of(joints.begin(), joints.end(), counts_turns)) return angles;
  for (const Joint& joint : joints) {
    const auto pose = [&](int body) { return rigid.state[static_cast<std::size_t>(body)].pose; };
    const double angle = angle_of(JointFrames(joint, pose(joint.parent), pose(joint.child)));
    const bool is_bounded = !counts_turns(joint) || joint.angle.any();
    angles.push_back(is_bounded ? angle : nearest_angle(angle, joint.control.target.value(0).x()));
  }
  return angles;
}

void JointSolver::drive_rows(const Articulation& articulation, const RigidBodies& rigid, RateAt at, double dt,
                             double seconds, std::vector<DriveRow>& rows) const {
  DUET_ASSERT(articulation.joints.size() == ends_.size() && dt > 0 && seconds > 0);
  rows.clear();
  for (std::size_t j = 0; j < ends_.size(); ++j)
    for (std::size_t r = first_[j]; r < first_[j + 1]; ++r) {
      const JointRow& geometry = rows_[r];
      if (geometry.role == RowRole::structure) continue;
      const Joint& joint = articulation.joints[j];
      const Bounds bounds = drive_bounds(joint, geometry.role, seconds);
      const double target = drive_rate(joint, j, r, rigid, at, dt);
      if (std::isinf(target) || (bounds.least == 0 && bounds.most == 0)) continue;
      rows.push_back({r, ends_[j].parent, ends_[j].child, geometry, target, bounds});
    }
}

double JointSolver::drive_rate(const Joint& joint, std::size_t j, std::size_t r, const RigidBodies& rigid,
                               RateAt at, double dt) const {
  const JointRow& row = rows_[r];
  const Pose &parent = rigid.state[ends_[j].parent].pose, &child = rigid.state[ends_[j].child].pose;
  if (row.role == RowRole::limit) {
    const double slack = limit_slack(joint, row, JointFrames(joint, parent, child));
    return at == RateAt::whole_step ? limit_rate(slack, dt) : end_rate(r, slack);
  }
  const Vec3& rate = at == RateAt::whole_step ? rates_[j].mean : rates_[j].end;
  return wanted(row, rate, parent.orientation * joint.parent_frame.orientation);
}

void JointSolver::start_drive(std::size_t row, double impulse) {
  DUET_ASSERT(row < rows_.size() && rows_[row].role != RowRole::structure);
  impulse_[row] = impulse;
  free_[row] = least_[row] < impulse && impulse < most_[row];
}

template <class Counts>
void JointSolver::sum_impulses(const std::vector<double>& impulses, std::vector<Vec3>& linear,
                               std::vector<Vec3>& angular, Counts&& counts) const {
  DUET_ASSERT(impulses.size() == rows_.size());
  linear.assign(predicted_.size(), Vec3::Zero());
  angular.assign(predicted_.size(), Vec3::Zero());
  for_each_row([&](std::size_t j, std::size_t r) {
    const JointRow& row = rows_[r];
    if (!counts(row.role)) return;
    linear[ends_[j].child] += impulses[r] * row.linear;
    linear[ends_[j].parent] -= impulses[r] * row.linear;
    angular[ends_[j].child] += impulses[r] * row.child_moment;
    angular[ends_[j].parent] -= impulses[r] * row.parent_moment;
  });
}

void JointSolver::kept_impulses(HalfwayLimits limits, std::vector<Vec3>& linear,
                                std::vector<Vec3>& angular) const {
  sum_impulses(impulse_, linear, angular, [&](RowRole role) {
    return role == RowRole::structure || (role == RowRole::limit && limits == HalfwayLimits::are_kept);
  });
}

void JointSolver::sum_drive(const std::vector<double>& impulses, std::vector<Vec3>& linear,
                            std::vector<Vec3>& angular) const {
  sum_impulses(impulses, linear, angular, [](RowRole role) { return role != RowRole::structure; });
}

}  // namespace duet
