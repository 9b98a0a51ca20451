// Contact constraints in the conjugate gradients (paper sections 7.1 and 7.3, equations 3 and 4).
#pragma once

#include <vector>

#include "sim/articulation/joint_solver.h"
#include "sim/contact/graph/contact_graph.h"
#include "sim/contact/response/articulated_response.h"
#include "sim/contact/response/warm_start.h"
#include "sim/deformable/self_contact/self_repulsion.h"
#include "sim/state/islands.h"

namespace duet {

// Unknowns of the implicit solve: velocities of all particles and twists of all rigid bodies.
struct GeneralizedVelocity {
  std::vector<Vec3> particle;  // m/s
  std::vector<Vec3> linear;    // m/s
  std::vector<Vec3> angular;   // rad/s
};

// Projects generalized velocities so that touching points keep their normal relative velocity. Each
// application is impulses, equal and opposite, so momentum is kept; sweeps go forward and then backward, so
// the operator is self-adjoint in the mass inner product even where it has not converged.
class ContactProjection {
 public:
  // Takes the contacts of `graph` that hold an impulse, at the geometry they hold, and the pairs of
  // `repulsions`, if any, as the innermost of each sweep. `linked` is what prepared the contacts, or null.
  // Contacts of the deformable bodies that `rests` names, if there are any, hold the tangential components of
  // the relative velocity as well where they stick.
  void build(const Bodies& bodies, const ContactSet& contacts, const ContactGraph& graph, int sweeps,
             SelfRepulsion* repulsions = nullptr, const ArticulatedResponse* linked = nullptr,
             const std::vector<char>& rests = {});
  // Takes the contacts that held one at the end of the last step, at the positions now.
  // Their impulses count as those of `duration` (s). Contacts of the deformable bodies that `left_out` names,
  // if there are any, are left out.
  void build(const Bodies& bodies, const ContactCache& memory, double duration, int sweeps,
             const ArticulatedResponse* linked = nullptr, const std::vector<char>& left_out = {});
  // Takes no contact.
  void build(const Bodies& bodies);
  // Keeps joints together, too, exactly, until the next build. The solver has been prepared for projection.
  void add_joints(const JointSolver& joints) {
    joints_ = &joints;
    held_ = held_ || joints.is_held();
  }
  // Projects in the inner product of other masses of the particles until the next build: `inverse_mass`,
  // 1/kg, or null for their own.
  void use_inverse_masses(const std::vector<SymmetricBlock>* inverse_mass);
  bool empty() const { return rows_.empty() && block_rows_ == 0 && !repulsions_ && !joints_; }
  // Joins the bodies that it lets move each other, but for those with joints, which are joined anyway.
  void join(Islands& islands) const;
  // Only what acts on islands that are searched takes part in project() and use_inverse_masses(), until the
  // next call; null for all.
  void limit_to(const Islands* islands);
  // Whether a body of infinite mass takes part.
  bool is_held() const { return held_; }

  // Asks n.v_rel to be half of what it is for `start` (so that the extrapolated end-of-step value is zero),
  // and drops for this solve the constraints that part anyway at `velocity`. Of pairs of deformable surfaces
  // those are rows that would come too near within the step of `dt` (s): SelfRepulsion::choose_rows().
  void choose(double dt, const GeneralizedVelocity& start, const GeneralizedVelocity& velocity);
  // Makes `velocity` satisfy what is asked.
  void satisfy(GeneralizedVelocity& velocity) const;
  // Adds what the friction of the chosen contacts does to `velocity`. Projection leaves the tangents free:
  // what friction holds, or drags along, would be damped as if it slid freely, and friction after the solve,
  // which sees the masses of particles without what damps them, would move them far too much in every step.
  void add_friction(GeneralizedVelocity& velocity) const;
  // Drops, for this solve, the constraints that hold back what `change` (of velocities, without
  // constraints) would part faster than by `tolerance` (m/s). Returns whether there were any.
  bool release(const GeneralizedVelocity& change, double tolerance);
  // Projects onto n.v_rel = 0.
  void project(GeneralizedVelocity& velocity) const;

 private:
  struct Row {  // one contact point
    int host = -1, guest_rigid = -1;
    SurfacePoint point;  // of a deformable guest
    Vec3 normal, host_arm, guest_arm;
    Vec3 friction;       // N s, on the guest
    double of_host = 0;  // 1/kg, in the inverse of a single row's mass
    double mass = 0;     // kg, 1/(n.K n) of the guest alone in a block, of the pair in a single row
    double target = 0;   // m/s
    bool active = true;
    int island = -1;  // of limit_to
  };
  struct Block {  // one rigid body against all particles it touches: equation 4
    int host = -1;
    std::vector<Row> rows;
    Mat6 inverse = Mat6::Zero();
    Mat6 weight = Mat6::Zero();  // kg, kg m, kg m^2: of the particles, for twists of a linked host
  };
  void begin(const Bodies& bodies, int sweeps, const ArticulatedResponse* linked);
  void add(const ContactPoint& contact, bool holds_sticking);
  void add_row(Row& row, const ContactPoint& contact, bool is_held);
  void factor_blocks();
  void factor(Block& block) const;
  void project_block(const Block& block, bool with_target, GeneralizedVelocity& v) const;
  void project_row(const Row& row, bool with_target, GeneralizedVelocity& v) const;
  void sweep(bool with_target, bool with_joints, GeneralizedVelocity& v) const;
  void sweep_all(bool with_target, GeneralizedVelocity& v) const;
  bool takes(const Row& row) const {
    return row.active && (!islands_ || islands_->is_searched(static_cast<std::size_t>(row.island)));
  }
  // Those that the body is linked with, or null.
  const ArticulatedResponse* links_of(int body) const {
    return linked_ && linked_->contains(body) ? linked_ : nullptr;
  }
  void push_rigid(int body, const Vec3& arm, const Vec3& impulse, GeneralizedVelocity& v) const;
  // 1/kg, of the particles of a deformable guest along the normal.
  double inverse_mass_of_guest(const Row& row) const;
  double normal_velocity(const Row& row, const GeneralizedVelocity& v) const;
  void push(const Row& row, const Vec3& impulse, GeneralizedVelocity& v) const;       // on the guest
  void push_host(const Row& row, const Vec3& impulse, GeneralizedVelocity& v) const;  // the opposite

  const Bodies* bodies_ = nullptr;
  const std::vector<SymmetricBlock>* inverse_mass_ = nullptr;  // null: that of the particles
  std::vector<Block> blocks_;  // reused from step to step; the first `used_` count
  std::size_t used_ = 0, block_rows_ = 0;
  std::vector<Row> rows_;
  bool held_ = false;
  SelfRepulsion* repulsions_ = nullptr;
  const JointSolver* joints_ = nullptr;
  const ArticulatedResponse* linked_ = nullptr;
  const Islands* islands_ = nullptr;
  int sweeps_ = 1;
};

}  // namespace duet
