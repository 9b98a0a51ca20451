// The energy of jointed bodies while their positions advance: a projection of the end velocities onto the
// energy that RATTLE misses.
#pragma once

#include <vector>

#include "sim/articulation/joint_solver.h"

namespace duet {

/// Corrects the velocities of jointed bodies so that a step keeps their energy:
///
///     u'' = r + s (u' - r),   s^2 = 1 - E / K(u' - r),   E = K(u') - K(u) - W.
///
/// Here u and u' are velocities at x^n and at x^{n+1} that satisfy the joints, K is the kinetic energy of a
/// group of jointed bodies, W the work of gravity that the step's velocities miss, and r the rigid motion of
/// the group that carries the momentum of u'.
///
/// Between u and u', jointed bodies move by the RATTLE method (Andersen 1983): impulses along the joint rows
/// of x^n lead from u to the velocities v* that take the bodies to where the joints fit again, and impulses
/// along the rows of x^{n+1} lead from v* to u'. RATTLE keeps linear and angular momentum, and energy to
/// second order in the step. Neither the momentum nor the velocities of the joint rows depend on s, and the
/// energy of u'' is K(u) + W. A projection onto the invariants of the motion keeps the order of the method
/// (Hairer, Lubich, Wanner, Geometric Numerical Integration, section IV.4).
class FreeMotion {
 public:
  /// Finds the groups of dynamic bodies that joints connect, and sizes all arrays for `rigid`.
  void analyze(const Articulation& articulation, const RigidBodies& rigid);

  /// Records the energy that the motion starts with; to be called at x^n.
  ///
  /// `joints` holds the rows of x^n, and `rigid` the velocities v*, in which `gravity` (m/s^2) has acted for
  /// half of the step `dt` (s). Changes what `joints` is prepared for: it is left prepared for projection.
  void begin(JointSolver& joints, const RigidBodies& rigid, const Vec3& gravity, double dt);

  /// The result of finish().
  struct Outcome {
    /// Largest energy error |E| of a group, as a fraction of its internal energy K(u' - r) (1, 0: none).
    ///
    /// The internal energy is taken to be at least 0.005 K(u'), and what gravity does in the step is added to
    /// it.
    double excess = 0;
    /// Momentum that bodies of infinite mass have given through their joints with the groups, by the
    /// correction.
    JointSolver::Outside outside;
  };
  /// Adds u'' - u' to the velocities of all groups; to be called at x^{n+1}.
  ///
  /// `joints` holds the rows of x^{n+1}. |s - 1| is limited to 0.05. Groups that are jointed to a kinematic
  /// body in motion are left alone, because that body supplies whatever energy the motion needs.
  Outcome finish(JointSolver& joints, RigidBodies& rigid);

 private:
  // Dynamic bodies that joints connect.
  struct Group {
    std::vector<std::size_t> members;       // rigid bodies
    std::vector<std::size_t> fixed_joints;  // joints of a member with a body that is not dynamic
    double energy = 0;                      // J, K(u) + the terms of W that are known at x^n
    bool is_fixed() const { return !fixed_joints.empty(); }
  };
  // A rigid motion of a group.
  struct Rigid {
    Vec3 center = Vec3::Zero(),  // m, center of mass of the group
        v = Vec3::Zero(),        // m/s, at the center
        w = Vec3::Zero();        // rad/s, world axes
    double mass = 0;             // kg
  };
  // Projects linear_ and angular_ onto velocities that keep the joints together. If gravity acts on a group
  // that is fixed somewhere, fills fall_ and fall_turn_ with the projected acceleration of gravity.
  void project(JointSolver& joints, const RigidBodies& rigid);
  // Returns the kinetic energy (J) of a group that moves with the given velocities (m/s, rad/s).
  double kinetic(const RigidBodies& rigid, const Group& group, const std::vector<Vec3>& linear,
                 const std::vector<Vec3>& angular) const;
  // Returns the power of gravity (W) on a group that moves with the velocities `linear` (m/s). With
  // accelerations (m/s^2) in their place the result is in W/s.
  double weight_power(const RigidBodies& rigid, const Group& group, const std::vector<Vec3>& linear) const;
  // Returns whether a kinematic body that moves in this step is jointed to the group.
  bool held_by_motion(const JointSolver& joints, const RigidBodies& rigid, const Group& group) const;
  // Returns the rigid motion r of the group (see the definition).
  Rigid rigid_motion(const JointSolver& joints, const RigidBodies& rigid, const Group& group) const;
  // Applies the correction u'' - u' to one group and returns its contribution to Outcome::excess. Uses
  // linear_ and angular_ of the members as scratch.
  double correct(const JointSolver& joints, RigidBodies& rigid, const Group& group,
                 JointSolver::Outside& outside);

  std::vector<Group> groups_;
  std::vector<std::size_t> bodies_;  // rigid bodies with a joint: members of groups and their fixed partners
  bool any_fixed_ = false;           // true if any group has a fixed joint
  Vec3 gravity_ = Vec3::Zero();      // m/s^2
  double dt_ = 0;                    // s
  // Per rigid body:
  std::vector<Vec3> linear_,       // m/s, u at x^n or u' at x^{n+1}
      angular_,                    // rad/s, the same velocities' rotation
      fall_,                       // m/s^2, acceleration of gravity under the joints, P g
      fall_turn_;                  // rad/s^2, angular acceleration of P g
  std::vector<Vec3> path_linear_,  // m/s, v*
      path_momentum_;              // kg m^2/s, angular momentum of v*
  std::vector<Pose> start_;        // pose at x^n
};

}  // namespace duet
