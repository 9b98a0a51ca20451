// The rows of control, friction and limits of joints as a velocity solve takes them, and what it gives back.
#include <algorithm>
#include <cmath>

#include "sim/articulation/joint_solver.h"

namespace duet {

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

}  // namespace duet
