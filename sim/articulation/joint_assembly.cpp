// Positions of joints: JointSolver::assemble() moves bodies so that their joints fit, and drift() measures
// how far they have come apart.
#include <algorithm>
#include <cmath>

#include "sim/articulation/joint_solver.h"
#include "sim/base/rotation.h"

namespace duet {
namespace {

// Largest number of lengths that are tried for one Newton step of positions, each half of the one before.
constexpr int max_cuts = 3;
// Largest number of rounds of Levenberg's method for positions.
constexpr int max_softened = 40;
// Bounds of Levenberg's softness, as a fraction of the diagonal. The search ends when the upper one does not
// help, because then no step brings the joints nearer to each other.
constexpr double min_softness = 1e-8, max_softness = 1e-2;
// Largest error of positions that counts as assembled, m or rad: rounding at sizes of 1 m, with two digits to
// spare.
constexpr double assembled = 1e-13;

}  // namespace

void JointSolver::move(RigidBodies& rigid, std::size_t body, const Vec3& linear, const Vec3& angular) {
  const RigidProperties& properties = rigid.properties[body];
  if (!properties.is_dynamic()) return;
  RigidState& state = rigid.state[body];
  state.pose.position += properties.inverse_mass * linear;
  state.pose.orientation =
      (exponential(state.inverse_inertia * angular) * state.pose.orientation).normalized();
}

JointSolver::Gaps JointSolver::gaps(const Articulation& articulation, const RigidBodies& rigid) {
  Gaps gaps;
  for_each_row([&](std::size_t j, std::size_t r) {
    const auto [parent, child] = ends_[j];
    const JointFrames frames(articulation.joints[j], rigid.state[parent].pose, rigid.state[child].pose);
    const bool counts = rows_[r].role == RowRole::structure;
    const double error =
        counts ? structure_error(articulation.joints[j], rows_[r], frames, reference_[j]) : 0;
    solution_[j](static_cast<Eigen::Index>(r - first_[j])) = -error;
    gaps.largest = std::max(gaps.largest, std::abs(error));
    gaps.squares += error * error;
  });
  return gaps;
}

// Takes a Newton step (softness 0) or a Levenberg step on the rows of the poses now, and halves it until the
// sum of squared errors decreases. Returns false, with the states unchanged, if it does not.
bool JointSolver::approach(const Articulation& articulation, RigidBodies& rigid, double softness) {
  const double before = gaps(articulation, rigid).squares;
  free_structure_only();
  factor(rigid, softness);
  system_.solve(solution_);
  for_each_row([&](std::size_t j, std::size_t r) {
    residual_[r] = solution_[j](static_cast<Eigen::Index>(r - first_[j]));
  });
  save_states(rigid);
  double share = 1;
  for (int cut = 0; cut < max_cuts; ++cut, share /= 2) {
    for_each_row([&](std::size_t j, std::size_t r) {
      const JointRow& row = rows_[r];
      const double impulse = share * residual_[r];
      move(rigid, ends_[j].child, impulse * row.linear, impulse * row.child_moment);
      move(rigid, ends_[j].parent, -impulse * row.linear, -impulse * row.parent_moment);
    });
    if (gaps(articulation, rigid).squares < before) return true;
    restore_states(rigid);
  }
  return false;
}

// Levenberg's method. Near singular poses, such as a loop that lies flat, the joints can move in fewer
// directions than elsewhere, and Newton's steps are far too long; softness shortens them.
double JointSolver::assemble(const Articulation& articulation, RigidBodies& rigid) {
  double softness = 0;
  for (int round = 0; round < max_softened; ++round) {
    update(articulation, rigid);
    if (gaps(articulation, rigid).largest <= assembled) break;
    if (approach(articulation, rigid, softness)) {
      softness = softness > min_softness ? softness / 10 : 0;
      for (const std::size_t body : jointed_)
        update_orientation_dependents(rigid.state[body], rigid.properties[body]);
    } else if (softness < max_softness) {
      softness = std::max(min_softness, 100 * softness);
    } else {
      break;
    }
  }
  return gaps(articulation, rigid).largest;
}

JointSolver::Drift JointSolver::drift(const Articulation& articulation, const RigidBodies& rigid) {
  Drift drift;
  for (std::size_t j = 0; j < articulation.joints.size(); ++j) {
    const Joint& joint = articulation.joints[j];
    const JointFrames frames(joint, rigid.state[static_cast<std::size_t>(joint.parent)].pose,
                             rigid.state[static_cast<std::size_t>(joint.child)].pose);
    Vec3 gap = Vec3::Zero();
    for (const JointRow& row : rows_of(joint)) {
      if (row.role != RowRole::structure) continue;
      const double error = structure_error(joint, row, frames, frames.relative());
      if (row.motion == RowMotion::travel)
        gap[row.axis] = error;
      else
        drift.angle = std::max(drift.angle, std::abs(error));
    }
    if (drift.joint < 0 || gap.norm() > drift.gap) {
      drift.gap = gap.norm();
      drift.joint = static_cast<int>(j);
    }
  }
  return drift;
}

}  // namespace duet
