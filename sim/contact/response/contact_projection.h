// Projection of velocities onto contact, joint and repulsion constraints, for use inside conjugate gradients
// (paper sections 7.1 and 7.3, equations 3 and 4).
#pragma once

#include <vector>

#include "sim/articulation/joint_solver.h"
#include "sim/contact/graph/contact_graph.h"
#include "sim/contact/response/articulated_response.h"
#include "sim/contact/response/warm_start.h"
#include "sim/deformable/self_contact/self_repulsion.h"
#include "sim/state/generalized_velocity.h"
#include "sim/state/islands.h"

namespace duet {

/// The bodies whose sticking contacts a projection holds along their tangents, too.
struct StickingBodies {
  const std::vector<char>* rests = nullptr;  ///< Per deformable body, whether it is one; null: none is.
  /// Largest fraction of its friction cone that the impulse of a contact that sticks may use. The default
  /// leaves room for rounding. If normals have turned since the impulses were found, ones that slide seem to
  /// be within the cone.
  double cone_share = 1 - 1e-6;
};

/// A projection of generalized velocities onto those that satisfy constraints: touching points have no normal
/// relative velocity, joints hold, and near surfaces do not approach. It works by impulses that are equal and
/// opposite at one place, so that momentum is kept. Sweeps go forward and then backward, so that the operator
/// is self-adjoint in the mass inner product even if the sweeps have not converged (paper section 7.3).
///
/// A rigid body against all single particles that it touches is one block, solved exactly by equation 4.
/// Other contacts are single rows. Constraints form an active set: choose() and activate_violated()
/// activate, release() deactivates.
class ContactProjection {
 public:
  /// Takes the contacts of `graph` that hold an impulse, with their present normals, arms and responses, and
  /// the pairs of `repulsions` (or null), which are innermost in each sweep. `sweeps` is the number of sweeps
  /// to and fro of one projection. `linked` is the articulated response that prepared the contacts, or null.
  /// `sticking` says which contacts have rows along both tangents, too.
  void build(const Bodies& bodies, const ContactSet& contacts, const ContactGraph& graph, int sweeps,
             SelfRepulsion* repulsions = nullptr, const ArticulatedResponse* linked = nullptr,
             const StickingBodies& sticking = {});
  /// Takes the cached contacts of the last step, with the geometry of the present positions. Their impulses
  /// are scaled to `duration` (s). `left_out` has an entry for every deformable body, or is empty: the
  /// contacts of marked bodies are left out. `linked` must be what ArticulatedResponse::prepare() returned
  /// for `cache`. `sticking` is as above, with the friction of the bodies.
  void build(const Bodies& bodies, const ContactCache& cache, double duration, int sweeps,
             const ArticulatedResponse* linked = nullptr, const std::vector<char>& left_out = {},
             const StickingBodies& sticking = {});
  /// Takes no contact, so that only joints are projected, if add_joints() follows.
  void build(const Bodies& bodies);
  /// Adds joints as constraints until the next build. They are kept exactly. `joints` must have been prepared
  /// for projection, and must outlive the use of this object.
  void add_joints(const JointSolver& joints) {
    joints_ = &joints;
    held_ = held_ || joints.is_held();
  }
  /// Adds the pairs of `repulsions` as constraints until the next build. It must outlive the use of this
  /// object. `left_out` has an entry for every deformable body, or is empty: the pairs with a marked body are
  /// left out.
  void add_repulsions(SelfRepulsion& repulsions, const std::vector<char>& left_out);
  /// Projects in the inner product of other particle masses until the next build: `inverse_mass` has a block
  /// (1/kg) for every particle and must outlive the use. Null restores the masses of the particles.
  void use_inverse_masses(const std::vector<SymmetricBlock>* inverse_mass);
  /// Returns whether there are no contacts, repulsions and joints, so that the projection is the identity.
  bool empty() const { return rows_.empty() && block_rows_ == 0 && !repulsions_ && !joints_; }
  /// Joins the bodies that contacts and active repulsion pairs connect. Islands::begin() has joined bodies of
  /// joints.
  void join(Islands& islands) const;
  /// Limits project(), satisfy() and use_inverse_masses() to the constraints of searched `islands`, until the
  /// next call. Null removes the limit. Joints are not limited.
  void limit_to(const Islands* islands);
  /// Returns whether a body or particle of infinite mass takes part, so that momentum is exchanged with the
  /// outside.
  bool is_held() const { return held_; }

  /// Sets the targets and the active set of a solve for the velocity V at the fraction `at` (in [0.5, 1]) of
  /// a step. The target of n.v_rel is 1 - `at` times its value at `start`, so that the extrapolation v^n + (V
  /// - v^n) / `at` to the end of the step has none. Constraints that already separate faster at `velocity`
  /// are inactive. Repulsion pairs are active if they would come too near within `dt` (s), see
  /// SelfRepulsion::activate_rows(). Returns whether all constraints that may act are active.
  bool choose(double dt, double at, const GeneralizedVelocity& start, const GeneralizedVelocity& velocity);
  /// Activates the constraints that another `velocity` violates, and returns whether there were any. Whether
  /// a contact is loaded may depend on the others: two stacked boxes that both fall freely do not approach
  /// each other, but they do once the ground stops the lower one.
  bool activate_violated(double dt, double at, const GeneralizedVelocity& start,
                         const GeneralizedVelocity& velocity);
  /// Projects `velocity` onto those with n.v_rel = target at the active constraints.
  void satisfy(GeneralizedVelocity& velocity) const;
  /// Adds M^-1 times `share` times the friction impulses of the active contacts to `velocity`. The projection
  /// leaves tangential motion free: without this, damping would act as if everything slid freely, and
  /// friction after the solve, which sees the masses of particles without their damping, would move them far
  /// too much in every step.
  void add_friction(double share, GeneralizedVelocity& velocity) const;
  /// Deactivates constraints that would have to pull: those that `change`, the change of velocities without
  /// constraints, separates faster than `tolerance` (m/s). Returns whether there were any.
  bool release(const GeneralizedVelocity& change, double tolerance);
  /// Projects `velocity` onto those with n.v_rel = 0 at the active constraints.
  void project(GeneralizedVelocity& velocity) const;

 private:
  // The constraint of one contact point along one direction.
  struct Row {
    int host = -1, guest_rigid = -1;  // rigid bodies; guest_rigid -1: the guest is deformable
    SurfacePoint point;               // of a deformable guest
    Vec3 normal,                      // unit: the normal, or a tangent of a contact that sticks
        host_arm, guest_arm;          // m
    Vec3 friction;                    // N s, friction impulse on the guest
    double of_host = 0;  // 1/kg, what the host adds to 1/mass of a single row with a deformable guest
    double mass = 0;     // kg, 1/(n.K n): of the guest alone in a block, of both bodies in a single row
    double target = 0;   // m/s, wanted relative velocity along `normal`
    bool active = true;
    int island = -1;  // set by limit_to()
  };
  // One rigid body against all single particles that it touches: equation 4.
  struct Block {
    int host = -1;
    std::vector<Row> rows;
    Mat6 inverse = Mat6::Zero();  // inverse of the matrix of equation 4
    Mat6 weight = Mat6::Zero();   // kg, kg m, kg m^2: sum over active rows of mass w w^T with the wrench w of
                                  // a unit push
  };
  void begin(const Bodies& bodies, int sweeps, const ArticulatedResponse* linked);
  // Which rows a contact that sticks has.
  enum class StickingRows {
    normal,               // one along its normal, as other contacts have
    normal_and_tangents,  // two along its tangents as well
  };
  // Adds the rows of a contact. `cone_share` is that of StickingBodies.
  void add(const ContactPoint& contact, StickingRows rows, double cone_share);
  // Adds `row`, which is along row.normal, to a block or as a single row. `is_held`: no particle of the guest
  // can move.
  void add_row(Row& row, const ContactPoint& contact, bool is_held);
  void factor_blocks();
  void factor(Block& block) const;
  void project_block(const Block& block, ProjectTo goal, GeneralizedVelocity& v) const;
  void project_row(const Row& row, ProjectTo goal, GeneralizedVelocity& v) const;
  // Makes one sweep to and fro over all constraints; `joints` are those among them, or null.
  void sweep(ProjectTo goal, const JointSolver* joints, GeneralizedVelocity& v) const;
  void sweep_all(ProjectTo goal, GeneralizedVelocity& v) const;
  bool takes(const Row& row) const {
    return row.active && (!islands_ || islands_->is_searched(static_cast<std::size_t>(row.island)));
  }
  // Returns the articulated response if it contains the body, else null.
  const ArticulatedResponse* links_of(int body) const {
    return linked_ && linked_->contains(body) ? linked_ : nullptr;
  }
  // Adds M^-1 times an impulse on a rigid body, or on its jointed group.
  void push_rigid(int body, const Vec3& arm, const Vec3& impulse, GeneralizedVelocity& v) const;
  // Returns the inverse effective mass of a deformable guest along row.normal, 1/kg.
  double inverse_mass_of_guest(const Row& row) const;
  // Returns the relative velocity along row.normal, m/s.
  double normal_velocity(const Row& row, const GeneralizedVelocity& v) const;
  // Adds M^-1 times an impulse on the guest.
  void push(const Row& row, const Vec3& impulse, GeneralizedVelocity& v) const;
  // Adds M^-1 times the opposite of an impulse on the host.
  void push_host(const Row& row, const Vec3& impulse, GeneralizedVelocity& v) const;

  const Bodies* bodies_ = nullptr;
  const std::vector<SymmetricBlock>* inverse_mass_ = nullptr;  // null: the masses of the particles
  // one for each rigid body, reused from step to step; only the first `used_` count
  std::vector<Block> blocks_;
  std::size_t used_ = 0, block_rows_ = 0;  // number of rigid bodies; number of rows in blocks
  std::vector<Row> rows_;                  // single rows
  bool held_ = false;
  SelfRepulsion* repulsions_ = nullptr;
  const JointSolver* joints_ = nullptr;
  const ArticulatedResponse* linked_ = nullptr;
  const Islands* islands_ = nullptr;  // null: all
  int sweeps_ = 1;
};

}  // namespace duet
