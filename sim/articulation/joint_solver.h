// Direct solution for the impulses of all joints of a scene at once (paper sections 5.1 and 7.3; Weinstein,
// Teran, Fedkiw 2006, 2008).
#pragma once

#include <span>
#include <vector>

#include "sim/articulation/block_factor.h"
#include "sim/articulation/joint_control.h"
#include "sim/base/assert.h"
#include "sim/rigid/rigid_bodies.h"

namespace duet {

/// A row of control, friction or a limit, for a velocity solve that finds its impulse.
struct DriveRow {
  std::size_t row = 0,  ///< its number among the rows of all joints
      parent = 0,       ///< rigid body
      child = 0;        ///< rigid body
  JointRow geometry;    ///< its directions and moments
  double target = 0;    ///< m/s or rad/s, velocity that the row is to have
  Bounds bounds;        ///< N s or N m s, of the impulse
};

/// The time of the rates that rows of control, friction and limits are to have.
enum class RateAt {
  whole_step,  ///< means over the step, by which limits keep their distance at its end
  end          ///< those of the end of the step, at the poses then
};

/// Returns the angle (rad) of each joint at the start, for JointSolver::plan_control(); nothing if no joint
/// counts turns.
///
/// It counts as the one that is nearest to the target then, so that control begins with the shorter way. If
/// the angle has bounds, it is the one between -pi and pi.
std::vector<double> starting_angles(const Articulation& articulation, const RigidBodies& rigid);

/// Whether the impulses of limits in step III stay in the velocities at the end of the step.
enum class HalfwayLimits {
  are_kept,        ///< They stay where they acted, at x^n; step V finds the rest.
  are_found_again  ///< Step V finds all of them.
};

/// Solves for the impulses y of all joints at once:
///
///     J M^-1 J^T y = b,
///
/// where J holds the rows of all joints and b the changes of their velocities that are wanted.
///
/// The paper visits joints one after the other, in the order of the contact graph. A chain with a heavy end
/// then needs a number of rounds that grows with its length and with the ratio of the masses; the direct
/// solution needs none. Use: analyze() once; update() whenever poses have changed; then either stabilize(),
/// or begin_impulses() followed by pre_stabilize() or stabilize_and_control(), or a projection.
class JointSolver {
 public:
  /// Sets the structure: the joints of `articulation` between the bodies of `rigid`.
  ///
  /// It keeps no reference to either. Everything from earlier calls is dropped.
  void analyze(const Articulation& articulation, const RigidBodies& rigid);
  /// Returns whether there are no joints.
  bool empty() const { return ends_.empty(); }
  /// Returns the rows of a joint as of the last call of update().
  std::span<const JointRow> rows(std::size_t joint) const {
    DUET_ASSERT(joint < ends_.size());
    return {rows_.data() + first_[joint], first_[joint + 1] - first_[joint]};
  }
  /// Returns the parent body of a joint.
  std::size_t parent(std::size_t joint) const { return ends_[joint].parent; }
  /// Returns the child body of a joint.
  std::size_t child(std::size_t joint) const { return ends_[joint].child; }
  /// Returns the dynamic bodies that have a joint, in ascending order.
  const std::vector<std::size_t>& bodies() const { return jointed_; }

  /// Sets directions and moments of all rows for the poses of `rigid` now.
  ///
  /// All functions below act on these rows.
  void update(const Articulation& articulation, const RigidBodies& rigid);

  /// Plans the rates of controlled joints over the step from `time` (s) to `time + dt`, and at its end.
  ///
  /// The rates follow from the poses and velocities of `rigid` now; see control_rates(), also for `angle`
  /// (rad), which has an entry for each joint, or none if no joint counts turns.
  void plan_control(const Articulation& articulation, const RigidBodies& rigid, double time, double dt,
                    std::vector<double>& angle);

  /// Post-stabilization: changes the velocities so that the structure rows of all joints have velocity zero.
  ///
  /// Control, friction and limits take no part. Returns the largest violation of a row before, m/s or rad/s.
  double stabilize(RigidBodies& rigid);
  /// Starts new sums of impulses, for calls of pre_stabilize() and stabilize_and_control() to add to.
  ///
  /// The impulses of control and friction stay within the joints' bounds of force and torque times `seconds`.
  void begin_impulses(const Articulation& articulation, double seconds);
  /// Pre-stabilization: changes the velocities so that all joints fit after `dt` (s).
  ///
  /// It solves for the structure and limits at the predicted poses (paper section 5.1), and for the mean
  /// rates of control and friction now. Bodies that are not dynamic are at `end_pose` after the step;
  /// `orientation` is the update that will move the others. If the positions cannot be made to fit, as when a
  /// chain cracks like a whip, only the velocities at x^n are made to fit; then fits() returns false until
  /// the next begin_impulses(), and the positions need assemble(). Returns the largest violation of a row
  /// before, m/s or rad/s.
  double pre_stabilize(const Articulation& articulation, RigidBodies& rigid,
                       const std::vector<Pose>& end_pose, double dt, OrientationUpdate orientation);
  /// Returns whether pre_stabilize() made positions fit, in all calls since begin_impulses().
  bool fits() const { return fits_; }
  /// Post-stabilization with control, friction and limits at the poses now.
  ///
  /// Controlled joints take the rates planned for the end of the step. Limits act where their bound is
  /// reached, and where they have acted in the last pre_stabilize(). Returns the largest violation of a row
  /// before, m/s or rad/s.
  double stabilize_and_control(const Articulation& articulation, RigidBodies& rigid);
  /// Sums the impulses since begin_impulses() that stay in the velocities at the end of the step, on every
  /// rigid body: those of structure rows, and of limits if `limits` says so.
  ///
  /// `linear` is in N s, `angular` in N m s about the body's center of mass; both get one entry per rigid
  /// body.
  void kept_impulses(HalfwayLimits limits, std::vector<Vec3>& linear, std::vector<Vec3>& angular) const;
  /// Takes over the impulses of limits that pre_stabilize() has found and the velocities have already, after
  /// begin_impulses().
  void start_limits();
  /// Returns the impulses of all rows since begin_impulses(), N s or N m s.
  const std::vector<double>& impulses() const { return impulse_; }
  /// Sums `impulses`, given for all rows, of control, friction and limits in the same way.
  void sum_drive(const std::vector<double>& impulses, std::vector<Vec3>& linear,
                 std::vector<Vec3>& angular) const;
  /// Fills `rows` with the rows of control, friction and limits that can act at the poses now.
  ///
  /// `dt` (s) is the step, and `seconds` the time for which the impulses act: their bounds are those of force
  /// and torque times it.
  void drive_rows(const Articulation& articulation, const RigidBodies& rigid, RateAt at, double dt,
                  double seconds, std::vector<DriveRow>& rows) const;
  /// Takes over an impulse that a velocity solve has found and applied, after begin_impulses().
  ///
  /// The velocities have it already; the next solve for joints changes it by what they miss.
  void start_drive(std::size_t row, double impulse);
  /// An impulse that bodies of infinite mass have given to dynamic bodies through joints.
  struct Outside {
    Vec3 linear = Vec3::Zero(),  ///< N s
        angular = Vec3::Zero();  ///< N m s, about the origin of the world
  };
  /// Returns what bodies of infinite mass have given since the last call of stabilize() or begin_impulses().
  const Outside& from_outside() const { return outside_; }
  /// Returns whether any joint holds a body that is not dynamic.
  bool is_held() const { return held_; }

  /// Prepares project() for the structure rows of all joints.
  ///
  /// Drops the sums of impulses that begin_impulses() started.
  void prepare_projection(const RigidBodies& rigid);
  /// Prepares project() for the structure rows, and for the control rows without a bound of force or torque.
  ///
  /// Drops the sums of impulses that begin_impulses() started.
  void prepare_controlled_projection(const Articulation& articulation, const RigidBodies& rigid);
  /// Prepares project() for the rows of prepare_controlled_projection(), and for the limits that hold an
  /// impulse now.
  ///
  /// Keeps the sums of impulses.
  void prepare_limited_projection(const Articulation& articulation, const RigidBodies& rigid);
  /// Returns whether the limits that hold an impulse now are not those of the prepared projection.
  bool limits_have_changed() const;
  /// Projects velocities onto those for which the prepared rows have velocity zero.
  ///
  /// `linear` (m/s) and `angular` (rad/s, world axes) have an entry for every rigid body. The projection
  /// 1 - M^-1 J^T (J M^-1 J^T)^-1 J is self-adjoint in the mass inner product (paper section 7.3).
  void project(const RigidBodies& rigid, std::vector<Vec3>& linear, std::vector<Vec3>& angular) const;

  /// Moves bodies so that the joints fit again, by displacements that are small in the mass metric.
  ///
  /// The displacements are equal and opposite impulses over masses, so that the center of mass of bodies that
  /// joints connect stays where no body of infinite mass holds them. Changes poses, and angular velocities as
  /// the kept angular momenta ask. Returns the largest error of a structure row that is left, m or rad. The
  /// rows are those of the poses after it.
  double assemble(const Articulation& articulation, RigidBodies& rigid);

  /// The largest position errors of all joints.
  struct Drift {
    double gap = 0,  ///< m, largest distance of the anchors along fixed directions
        angle = 0;   ///< rad, largest error of a fixed angle
    int joint = -1;  ///< joint with the largest gap; -1: no joints
  };
  /// Measures how far joints have come apart at the poses of `rigid` now.
  static Drift drift(const Articulation& articulation, const RigidBodies& rigid);

 private:
  // The bodies of a joint.
  struct Ends {
    std::size_t parent = 0, child = 0;
  };
  // A dynamic body that two joints share.
  struct Shared {
    std::size_t joint = 0,  // the lesser joint, or equal to `other` for a block on the diagonal
        other = 0,          // the greater joint
        body = 0;           // the rigid body
  };
  // Calls visit(joint, row) for all rows, where `row` is an index into rows_.
  template <class Visit>
  void for_each_row(Visit&& visit) const {
    for (std::size_t j = 0; j + 1 < first_.size(); ++j)
      for (std::size_t r = first_[j]; r < first_[j + 1]; ++r) visit(j, r);
  }
  // Returns the velocity of a row (m/s or rad/s) for the velocities of `rigid`.
  double row_velocity(const RigidBodies& rigid, std::size_t joint, const JointRow& row) const;
  // Applies `impulse` (N s or N m s) on a row to both bodies.
  void push(RigidBodies& rigid, std::size_t joint, const JointRow& row, double impulse);
  // Applies an impulse (N s) and an angular impulse about the center of mass (N m s) to a body. If the body
  // is not dynamic, its opposite is counted in outside_ instead.
  void give(RigidBodies& rigid, std::size_t body, const Vec3& linear, const Vec3& angular);
  // Returns the block of J M^-1 J^T that couples the rows of shared.joint and shared.other through
  // shared.body.
  BlockFactor::Block coupling(const RigidBodies& rigid, const Shared& shared) const;
  // Factors J M^-1 J^T for the rows that are free now, unless the factors at hand are those. See
  // BlockFactor::factor for `softness`.
  void factor(const RigidBodies& rigid, double softness = 0);
  // Sums `impulses` of the rows whose role `counts` accepts on every rigid body.
  template <class Counts>
  void sum_impulses(const std::vector<double>& impulses, std::vector<Vec3>& linear,
                    std::vector<Vec3>& angular, Counts&& counts) const;
  // Clears all impulses, frees the structure rows without bounds, and holds all other rows at zero.
  void free_structure_only();
  // Fills solution_ with the impulses that change the velocities of free rows by residual_.
  void find_changes(const RigidBodies& rigid);
  // Applies the impulses that change the velocities of free rows by residual_.
  void solve_free(RigidBodies& rigid);
  // Changes which bounded rows are free; returns whether any did (see the definition).
  template <class Residual>
  bool revise_bounds(RigidBodies& rigid, Residual&& residual);
  // Returns whether the residual of a row that is held at a bound leads away from the bound.
  template <class Residual>
  bool leads_back(std::size_t j, std::size_t r, Residual&& residual) const;
  // Fills residual_ for the free rows (see the definition).
  template <class Residual>
  double find_residuals(Residual&& residual);
  // Newton's method for the free rows (see the definition). Returns the largest residual before the first
  // round.
  template <class Prepare, class Residual, class Take>
  double solve_rounds(Prepare&& prepare, Residual&& residual, Take&& take);
  // Takes the impulses of free rows toward the values that change the velocities by residual_, until the
  // first one meets a bound, which holds its row from then on. Returns whether any did.
  bool step_to_bound(RigidBodies& rigid);
  // Satisfies the rows from the impulses in start_impulse_ on, by steps that never add energy (see the
  // definition).
  template <class Prepare, class Residual>
  void descend(RigidBodies& rigid, Prepare&& prepare, Residual&& residual);
  // Changes velocities until `residual(joint, row)` vanishes for all free rows and bounded rows are
  // complementary to their bounds. `prepare()` is called before residuals are evaluated. Returns the largest
  // residual before the first round.
  template <class Prepare, class Residual>
  double satisfy(RigidBodies& rigid, Prepare&& prepare, Residual&& residual);
  // Position errors of structure rows.
  struct Gaps {
    double largest = 0,  // m or rad
        squares = 0;     // sum of squares
  };
  // Measures the position errors and fills solution_ with their negatives.
  Gaps gaps(const Articulation& articulation, const RigidBodies& rigid);
  // Takes one step of Newton's or Levenberg's method for the positions (see the definition).
  bool approach(const Articulation& articulation, RigidBodies& rigid, double softness);
  // Saves the states of jointed bodies and the sums of impulses.
  void save_states(const RigidBodies& rigid);
  // Restores what save_states() saved.
  void restore_states(RigidBodies& rigid);
  // Returns the kinetic energy of the change of velocities since save_states(), J.
  double changed_energy(const RigidBodies& rigid) const;
  // Returns the kinetic energy of the saved velocities, J.
  double jointed_energy(const RigidBodies& rigid) const;
  // Returns the velocity that a row is to have if the joint has the relative rate `rate` in the axes of the
  // parent's frame; zero for all rows but those of control.
  static double wanted(const JointRow& row, const Vec3& rate, const Quat& parent_axes);
  // Returns the bounds of the impulse of a row of control, friction or a limit within `seconds` (s).
  static Bounds drive_bounds(const Joint& joint, RowRole role, double seconds);
  // Returns the velocity that such a row `r` of joint `j` is to have; minus infinity for a limit out of
  // reach.
  double drive_rate(const Joint& joint, std::size_t j, std::size_t r, const RigidBodies& rigid, RateAt at,
                    double dt) const;
  // Returns the impulse of a limit row in the last pre_stabilize(), N s or N m s; 0 if it acted at the other
  // bound, or if the row is no limit.
  double halfway_limit(std::size_t r) const;
  // Returns the least velocity that a limit row may have over a step `dt` (s) with `slack` (m or rad) left.
  static double limit_rate(double slack, double dt);
  // Returns the least velocity that a limit row may have at the end of the step with `slack` (m or rad) left;
  // minus infinity if the limit does not act.
  double end_rate(std::size_t r, double slack) const;
  // Displaces a dynamic body by inverse mass times `linear` (kg m) and inverse inertia times `angular` (kg
  // m^2).
  static void move(RigidBodies& rigid, std::size_t body, const Vec3& linear, const Vec3& angular);

  std::vector<std::size_t> first_{0};  // the rows of joint j are rows_[first_[j], first_[j + 1])
  std::vector<JointRow> rows_;
  std::vector<Ends> ends_;  // per joint
  std::vector<Shared> shared_;
  std::vector<Quat> reference_;      // per joint, as set by update_rows()
  std::vector<ControlRates> rates_;  // per joint, as planned by plan_control()
  // Per row:
  std::vector<double> least_,  // N s or N m s, lower bound of the impulse
      most_,                   // N s or N m s, upper bound of the impulse
      impulse_,                // N s or N m s, sum since begin_impulses()
      residual_;               // m/s or rad/s, wanted velocity less velocity; in approach() an impulse
  std::vector<char> free_,     // true if the impulse is unknown, and not held at a bound
      factored_,               // free_ when the system was factored
      start_free_,             // scratch: free_ while a projection is prepared
      projected_limit_;        // true for the limits of the prepared projection
  std::vector<double> start_impulse_,  // impulse_ at the start of satisfy()
      halfway_;                        // N s or N m s, per limit: side times impulse in pre_stabilize()
  double dt_ = 0;                      // s, step of the last pre_stabilize()
  bool yields_ = false;                // true if rows with two bounds yield in system_, see descend()
  bool is_factored_ = false;           // true if system_ holds factors of the rows now, without softness
  BlockFactor system_;
  mutable std::vector<BlockFactor::Segment> solution_;  // per joint, right side and solution
  std::vector<Pose> predicted_;                         // per rigid body, at the end of the step
  bool fits_ = true,                                    // see fits()
      is_first_ = true;                // true if no pre_stabilize() has followed begin_impulses()
  bool held_ = false;                  // see is_held()
  Outside outside_;                    // see from_outside()
  std::vector<std::size_t> jointed_;   // dynamic bodies with a joint
  std::vector<RigidState> saved_;      // per jointed body
  std::vector<double> saved_impulse_;  // impulse_ at save_states()
  Outside saved_outside_;              // outside_ at save_states()
};

}  // namespace duet
