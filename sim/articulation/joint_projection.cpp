// The projection of velocities onto those that keep the joints, for use inside conjugate gradients and in the
// response of jointed bodies to contact.
#include <cmath>

#include "sim/articulation/joint_solver.h"
#include "sim/base/assert.h"

namespace duet {

void JointSolver::prepare_projection(const RigidBodies& rigid) {
  free_structure_only();
  factor(rigid);
}

void JointSolver::prepare_controlled_projection(const Articulation& articulation, const RigidBodies& rigid) {
  free_structure_only();
  for_each_row([&](std::size_t j, std::size_t r) {
    if (rows_[r].role == RowRole::control) free_[r] = std::isinf(articulation.joints[j].control.most);
  });
  factor(rigid);
}

void JointSolver::prepare_limited_projection(const Articulation& articulation, const RigidBodies& rigid) {
  start_free_ = free_;
  for_each_row([&](std::size_t j, std::size_t r) {
    const RowRole role = rows_[r].role;
    free_[r] = role == RowRole::structure || (role == RowRole::limit && impulse_[r] > 0) ||
               (role == RowRole::control && std::isinf(articulation.joints[j].control.most));
    projected_limit_[r] = role == RowRole::limit && free_[r];
  });
  factor(rigid);
  free_ = start_free_;
}

bool JointSolver::limits_have_changed() const {
  bool changed = false;
  for_each_row([&](std::size_t, std::size_t r) {
    const bool acts = rows_[r].role == RowRole::limit && impulse_[r] > 0;
    changed = changed || acts != static_cast<bool>(projected_limit_[r]);
  });
  return changed;
}

void JointSolver::project(const RigidBodies& rigid, std::vector<Vec3>& linear,
                          std::vector<Vec3>& angular) const {
  DUET_ASSERT(linear.size() == rigid.size() && angular.size() == rigid.size());
  DUET_ASSERT(is_factored_);
  for_each_row([&](std::size_t j, std::size_t r) {
    const auto [parent, child] = ends_[j];
    const JointRow& row = rows_[r];
    solution_[j](static_cast<Eigen::Index>(r - first_[j])) =
        !factored_[r] ? 0
                      : row.parent_moment.dot(angular[parent]) - row.child_moment.dot(angular[child]) -
                            row.linear.dot(linear[child] - linear[parent]);
  });
  system_.solve(solution_);
  for_each_row([&](std::size_t j, std::size_t r) {
    const JointRow& row = rows_[r];
    const double impulse = solution_[j](static_cast<Eigen::Index>(r - first_[j]));
    const auto [parent, child] = ends_[j];
    linear[child] += rigid.properties[child].inverse_mass * impulse * row.linear;
    linear[parent] -= rigid.properties[parent].inverse_mass * impulse * row.linear;
    angular[child] += rigid.state[child].inverse_inertia * (impulse * row.child_moment);
    angular[parent] -= rigid.state[parent].inverse_inertia * (impulse * row.parent_moment);
  });
}

}  // namespace duet
