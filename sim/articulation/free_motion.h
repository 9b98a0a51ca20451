/// The energy of jointed bodies while their positions advance.
#pragma once

#include <vector>

#include "sim/articulation/joint_solver.h"

namespace duet {

/// Between two velocities that satisfy the joints, u at x^n and u' at x^{n+1}, jointed bodies move by the
/// RATTLE method (Andersen 1983): impulses along the rows of x^n lead from u to the velocities v* that take
/// the bodies to where the joints fit again, and impulses along the rows of x^{n+1} lead from v* to u'.
/// Linear and angular momentum are kept, energy to second order in the step. This class replaces u' by
///
///   u'' = r + s (u' - r),   s^2 = 1 - E / K(u' - r),   E = K(u') - K(u) - W,
///
/// where K is the kinetic energy of a group of jointed bodies, W the work of gravity that the step's
/// velocities miss, and r the rigid motion of the group that carries the momentum of u'. Neither momentum nor
/// the velocities of the joints depend on s, and the energy of u'' is K(u) + W. As a projection onto the
/// invariants of the motion it keeps the order of the method (Hairer, Lubich, Wanner, Geometric Numerical
/// Integration, section IV.4).
class FreeMotion {
 public:
  /// Finds the groups of dynamic bodies that joints connect.
  void analyze(const Articulation& articulation, const RigidBodies& rigid);

  /// To be called at x^n, with the rows of `joints` there and the velocities v*, in which gravity (m/s^2) has
  /// acted for half of the step `dt` (s).
  void begin(JointSolver& joints, const RigidBodies& rigid, const Vec3& gravity, double dt);

  struct Outcome {
    double excess = 0;             ///< largest |E| of a group, relative to K(u' - r) or 0.005 K(u')
    JointSolver::Outside outside;  ///< momentum that fixed bodies have given
  };
  /// To be called at x^{n+1}, with the rows of `joints` there. Adds u'' - u' to the velocities.
  Outcome finish(JointSolver& joints, RigidBodies& rigid);

 private:
  struct Group {
    std::vector<std::size_t> members;
    std::vector<std::size_t> fixed_joints;  // with a body that is not dynamic
    double energy = 0;                      // K(u) + W as far as x^n tells, J
    bool is_fixed() const { return !fixed_joints.empty(); }
  };
  // The twist of a rigid motion, and of its mass: v (m/s) at the center, w (rad/s).
  struct Rigid {
    Vec3 center = Vec3::Zero(), v = Vec3::Zero(), w = Vec3::Zero();
    double mass = 0;
  };
  void project(JointSolver& joints, const RigidBodies& rigid);
  double kinetic(const RigidBodies& rigid, const Group& group, const std::vector<Vec3>& linear,
                 const std::vector<Vec3>& angular) const;
  double weight_power(const RigidBodies& rigid, const Group& group, const std::vector<Vec3>& linear) const;
  bool held_by_motion(const JointSolver& joints, const RigidBodies& rigid, const Group& group) const;
  Rigid rigid_motion(const JointSolver& joints, const RigidBodies& rigid, const Group& group) const;
  double correct(const JointSolver& joints, RigidBodies& rigid, const Group& group,
                 JointSolver::Outside& outside);

  std::vector<Group> groups_;
  std::vector<std::size_t> bodies_;  // of all groups, and those they are jointed to
  bool any_fixed_ = false;
  Vec3 gravity_ = Vec3::Zero();  // m/s^2
  double dt_ = 0;                // s
  // Of every rigid body, m/s and rad/s: u or u', and what gravity's acceleration (m/s^2, rad/s^2) becomes
  // under the joints.
  std::vector<Vec3> linear_, angular_, fall_, fall_turn_;
  std::vector<Vec3> path_linear_, path_momentum_;  // v*, m/s and kg m^2/s
  std::vector<Pose> start_;                        // at x^n
};

}  // namespace duet
