// All joints of a scene solved for at once (paper sections 5.1 and 7.3; Weinstein, Teran, Fedkiw 2006, 2008).
#pragma once

#include <span>
#include <vector>

#include "sim/articulation/block_factor.h"
#include "sim/articulation/joint_control.h"
#include "sim/rigid/rigid_bodies.h"

namespace duet {

// Impulses on all joints at once, by a direct solution of J M^-1 J^T y = b, where J holds the rows of all
// joints. The paper visits joints one after the other, in the order of the contact graph; a chain with a
// heavy end then needs a number of rounds that grows with its length and with the ratio of the masses, this
// none.
class JointSolver {
 public:
  // Of one structure: the joints of `articulation` between the bodies of `rigid`, both of which it keeps no
  // reference to.
  void analyze(const Articulation& articulation, const RigidBodies& rigid);
  bool empty() const { return ends_.empty(); }
  /// The rows of a joint, as of the last call of update().
  std::span<const JointRow> rows(std::size_t joint) const {
    return {rows_.data() + first_[joint], first_[joint + 1] - first_[joint]};
  }
  std::size_t parent(std::size_t joint) const { return ends_[joint].parent; }
  std::size_t child(std::size_t joint) const { return ends_[joint].child; }
  /// The dynamic bodies that have a joint.
  const std::vector<std::size_t>& bodies() const { return jointed_; }

  // Takes the rows of `articulation` at the poses now. Every function below acts on those rows.
  void update(const Articulation& articulation, const RigidBodies& rigid);

  // The rates that controlled joints are to have over the step from `time` to time + dt and at its end.
  void plan_control(const Articulation& articulation, const RigidBodies& rigid, double time, double dt);

  // Post-stabilization: changes the velocities so that no joint comes apart. This and the next two return by
  // how much the largest of the joints' relative velocities was off, m/s or rad/s.
  double stabilize(RigidBodies& rigid);
  // The impulses of the two below add up from here on, and those of control, friction and limits stay within
  // what the joints allow over `seconds`.
  void begin_impulses(const Articulation& articulation, double seconds);
  // Pre-stabilization (section 5.1): changes the velocities so that all joints fit after `dt`, under the mean
  // rates of control, friction and limits. Bodies that are not dynamic are then at `end_pose`. Where a step
  // is too long for that, as when a chain cracks like a whip, only the velocities at x^n fit, and fits() says
  // so: then the positions need assemble().
  double pre_stabilize(const Articulation& articulation, RigidBodies& rigid,
                       const std::vector<Pose>& end_pose, double dt, OrientationUpdate orientation);
  bool fits() const { return fits_; }
  // Post-stabilization with control, at its rates for the step's end, friction and limits.
  double stabilize_and_control(const Articulation& articulation, RigidBodies& rigid);
  // The impulses of the joints' structure since begin_impulses on every body, N s and N m s.
  void structure_impulses(std::vector<Vec3>& linear, std::vector<Vec3>& angular) const;
  // What bodies of infinite mass have given to the others since the last call of stabilize or begin_impulses:
  // N s, and N m s about the origin.
  struct Outside {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  };
  const Outside& from_outside() const { return outside_; }
  bool is_held() const { return held_; }  // whether a joint has such a body

  // Projects velocities of all rigid bodies, m/s and rad/s, onto those that keep the joints together:
  // self-adjoint in the mass inner product.
  void prepare_projection(const RigidBodies& rigid);
  // The same where controlled joints also keep their rates, as far as nothing bounds what control may do.
  void prepare_controlled_projection(const Articulation& articulation, const RigidBodies& rigid);
  void project(const RigidBodies& rigid, std::vector<Vec3>& linear, std::vector<Vec3>& angular) const;

  // Moves bodies so that the joints fit again, each by as little as can be in the mass metric: the centre of
  // mass stays. Returns the largest gap (m) or error of a
  // fixed angle (rad) that is left. Rows are those of the poses after it.
  double assemble(const Articulation& articulation, RigidBodies& rigid);

  // The largest gap of an anchor now, m, and error of a fixed angle, rad.
  struct Drift {
    double gap = 0, angle = 0;
    int joint = -1;  // that has the gap
  };
  static Drift drift(const Articulation& articulation, const RigidBodies& rigid);

 private:
  struct Ends {  // bodies of a joint
    std::size_t parent = 0, child = 0;
  };
  struct Shared {  // a dynamic body of two joints
    std::size_t joint = 0, other = 0, body = 0;
  };
  // Calls visit(joint, row) for all rows, numbers of both.
  template <class Visit>
  void for_each_row(Visit&& visit) const;
  double row_velocity(const RigidBodies& rigid, std::size_t joint, const JointRow& row) const;
  void push(RigidBodies& rigid, std::size_t joint, const JointRow& row, double impulse);
  void give(RigidBodies& rigid, std::size_t body, const Vec3& linear, const Vec3& angular);
  BlockFactor::Block coupling(const RigidBodies& rigid, const Shared& shared) const;
  void factor(const RigidBodies& rigid, double softness = 0);
  void free_structure_only();
  void solve_free(RigidBodies& rigid);
  template <class Residual>
  bool revise_bounds(RigidBodies& rigid, Residual&& residual);
  // Pushes until `residual(joint, row)` vanishes for all rows that are free; `prepare` comes before each
  // round.
  template <class Prepare, class Residual>
  double satisfy(RigidBodies& rigid, Prepare&& prepare, Residual&& residual);
  struct Gaps {
    double largest = 0, squares = 0;  // m or rad; their sum of squares
  };
  Gaps gaps(const Articulation& articulation, const RigidBodies& rigid);
  bool approach(const Articulation& articulation, RigidBodies& rigid, double softness);
  void save_states(const RigidBodies& rigid);
  void restore_states(RigidBodies& rigid);
  double changed_energy(const RigidBodies& rigid) const;
  double jointed_energy(const RigidBodies& rigid) const;
  static double wanted(const JointRow& row, const Vec3& rate, const Quat& parent_axes);
  static void move(RigidBodies& rigid, std::size_t body, const Vec3& linear, const Vec3& angular);

  std::vector<std::size_t> first_{0};  // rows of joint j: rows_[first_[j], first_[j + 1])
  std::vector<JointRow> rows_;
  std::vector<Ends> ends_;  // of every joint
  std::vector<Shared> shared_;
  std::vector<Quat> reference_;      // of every joint, as of update_rows
  std::vector<ControlRates> rates_;  // of every joint
  // Of every row: bounds of its impulse and the impulse (N s, or N m s), what its velocity lacks, and whether
  // its impulse is free to take that up or held at a bound.
  std::vector<double> least_, most_, impulse_, residual_;
  std::vector<char> free_, factored_;  // factored_: free_ when the system was factored
  bool is_factored_ = false;
  BlockFactor system_;
  mutable std::vector<BlockFactor::Segment> solution_;
  std::vector<Pose> predicted_;  // of every body
  bool fits_ = true, is_first_ = true;
  bool held_ = false;
  Outside outside_;
  std::vector<std::size_t> jointed_;  // dynamic bodies with a joint
  std::vector<RigidState> saved_;     // of those, before something was tried
  std::vector<double> saved_impulse_;
  Outside saved_outside_;
};

}  // namespace duet
