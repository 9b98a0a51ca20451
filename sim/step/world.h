// Everything that a time step reads and writes: settings, state, scratch and counters.
#pragma once

#include "sim/articulation/free_motion.h"
#include "sim/articulation/joint_solver.h"
#include "sim/contact/detection/contact_candidates.h"
#include "sim/contact/push_out/push_out.h"
#include "sim/contact/push_out/rigid_separation.h"
#include "sim/contact/response/articulated_response.h"
#include "sim/contact/response/collisions.h"
#include "sim/contact/response/contact_projection.h"
#include "sim/contact/response/contact_solver.h"
#include "sim/contact/response/turned_impulses.h"
#include "sim/contact/response/warm_start.h"
#include "sim/deformable/self_contact/self_collision.h"
#include "sim/deformable/self_contact/self_repulsion.h"
#include "sim/solve/conjugate_gradient.h"
#include "sim/solve/contact_forces.h"
#include "sim/solve/island_gradients.h"
#include "sim/solve/pressure_system.h"
#include "sim/solve/velocity_blocks.h"
#include "sim/solve/velocity_factor.h"
#include "sim/solve/velocity_system.h"
#include "sim/step/applied_forces.h"
#include "sim/step/composite_body.h"
#include "sim/step/contact_tally.h"
#include "sim/step/effects.h"
#include "sim/step/free_islands.h"
#include "sim/step/kinematic_motion.h"
#include "sim/step/stage_clock.h"
#include "sim/step/stage_hashes.h"
#include "sim/step/step_ledger.h"

namespace duet {

/// The settings of the solver.
struct StepSettings {
  /// True if elasticity is implicit in I.1 and V.2, by Newton's method; otherwise it is explicit.
  bool implicit_elasticity = false;
  int newton_iterations = 20;       ///< largest number of Newton iterations of a solve
  double cfl = 0.9;                 ///< time step as a fraction of the elastic stability limit
  double max_travel = 0.1;          ///< depth that a step may enter a dynamic rigid body, over its thickness
  double max_rotation = 0.314159;   ///< rad, largest turn of a rigid body in a step
  double max_time_step = 1.0 / 48;  ///< s
  /// Returns the time (s) below which two times count as the same: more than their rounding, far less than a
  /// step.
  double same_time() const { return 1e-6 * max_time_step; }
  double damping_at = 0.75;    ///< fraction of a step at which I.1, V.2 and V.3 evaluate damping forces
  double cg_tolerance = 1e-3;  ///< m/s, largest residual of a velocity solve
  int cg_iterations = 200;     ///< largest number of conjugate-gradient iterations of a solve
  int projection_sweeps = 4;   ///< sweeps, forward and backward, of a projection onto constraints
  /// True if the constraints of step V come before the solve instead of after it (paper section 7.2).
  bool constraints_before_solve = false;
  OrientationUpdate orientation = OrientationUpdate::exact;  ///< how dynamic bodies turn in step IV
  /// True if free islands with deformable bodies keep their angular momentum as positions move.
  bool keep_spin = true;
  bool contact_reduction = true;  ///< true if contacts that others make redundant are left out
  /// Interpenetration resolution; without `rigid_pairs`, rigid bodies are separated at all their contacts.
  PushOutSettings push_out;
  CollisionSettings collision;   ///< step II.1
  ContactSolveSettings contact;  ///< steps III.3 and V.4
  PressureSettings pressure;     ///< steps I.2 and V.1
};

/// Counts over the steps of a frame.
struct StepCounters {
  std::int64_t cg_iterations = 0;          ///< conjugate-gradient iterations of velocity solves
  std::int64_t pressure_iterations = 0;    ///< conjugate-gradient iterations of pressure solves
  std::int64_t newton_iterations = 0;      ///< iterations of Newton's method
  std::int64_t contact_sweeps = 0;         ///< Gauss-Seidel sweeps over contacts
  std::int64_t contacts = 0;               ///< contacts with an impulse, in the last step
  std::int64_t self_repulsions = 0;        ///< pairs nearer than their thickness, in the last step
  std::int64_t self_collisions = 0;        ///< impulses of self-collisions
  std::int64_t impact_zone_particles = 0;  ///< particles in rigid impact zones
};

/// Forces on all rigid bodies, or nothing.
struct RigidForces {
  std::vector<Vec3> linear,  ///< N, at the center of mass
      angular;               ///< N m, about the center of mass, world axes
};

/// One step's own values: sizes, times, the paper's named velocities, and scratch that keeps its storage.
///
/// Members that are called state are read by the next step and belong to checkpoints.
struct StepContext {
  double dt = 0;    ///< s, length of the step
  double time = 0;  ///< s, at the start of the step

  std::vector<Vec3> x_n;            ///< m, particle positions x^n
  std::vector<Vec3> x_next;         ///< m, predicted x^{n+1}, for the contact of deformable surfaces
  std::vector<Vec3> x_half;         ///< m, x^{n+1/2} = (x^n + x^{n+1}) / 2, from V.2 on; see AtMiddle
  std::vector<RigidState> rigid_n;  ///< rigid states of time n; from IV.1 on with the delays of the step
  VelocityState v_n;                ///< v^n
  VelocityState difference;         ///< v~^{n+1/2} - v^n
  VelocityState v_hat_n;            ///< v^^n, after collisions

  BroadPhase meeting;                    ///< pairs that can meet, for the choice of the time step
  std::vector<KinematicStep> kinematic;  ///< motions of kinematic bodies over this step

  std::vector<char> hangs;  ///< scratch: whether a rigid body hangs on joints from a body that is not dynamic
  std::vector<char> jointed_balls;  ///< scratch: whether a rigid body is a ball with joints and restitution
  JointSolver joints;               ///< joints, with their rows as of the last update
  FreeMotion free_motion;           ///< energy of jointed bodies as positions advance
  double joints_excess = 0;         ///< FreeMotion::Outcome::excess of this step
  /// How groups of jointed bodies respond to contact impulses.
  ArticulatedResponse articulated_response;
  std::vector<Pose> end_pose;  ///< poses at x^{n+1}, of rigid bodies that are not dynamic
  Momentum
      joints_from_outside;  ///< what fixed bodies gave through joints in finish_positions, for the ledger
  std::vector<Vec3> joint_push,  ///< N s, impulse of joints on each rigid body in step III
      joint_turn;                ///< N m s, angular impulse of joints on each rigid body in step III

  std::vector<double> control_angle;  ///< rad, per joint, with whole turns, see control_rates(); state
  RigidForces
      joint_drive_n,  ///< forces of control, friction and limits of joints in the last step's V; state
      joint_drive,    ///< the same of III, then of this step's V
      swept_drive;    ///< those of III outside the velocity solves
  std::vector<DriveRow> drive_rows;   ///< scratch: rows of control, friction and limits of joints
  std::vector<double> drive_impulse,  ///< N s or N m s, per row of joints: its impulse in III
      swept_impulse;                  ///< the same, zero for rows inside a velocity solve
  JointForces joint_forces;           ///< those of islands with contact inside their velocity solve

  ContactSet contacts;                     ///< contacts of this step
  ContactGraph graph;                      ///< order in which contact visits them
  ContactSolveScratch contact_solve;       ///< scratch of the contact solver
  ContactCache contact_cache;              ///< contact cache of the last step that succeeded; state
  CollisionScratch collision_scratch;      ///< scratch of step II.1
  PushOutScratch push_out_scratch;         ///< scratch of step IV.2
  SeparationScratch separation_scratch;    ///< scratch of step IV.2 between rigid bodies
  std::vector<ContactFrame> first_frames;  ///< frames of the contacts in step III
  ContactProjection projection;            ///< constraints of the solve at hand
  PressureScratch pressure;                ///< scratch of pressure solves
  std::vector<double>
      pressure_n,     ///< Pa, per one-ring, by which the last step kept v^{n+1} free of divergence; state
      pressure_next;  ///< Pa, per one-ring, the same of this step
  /// Scratch: per deformable body, whether its volumes change no faster than at rest.
  std::vector<char> rests;
  Islands calm;  ///< scratch; the islands that pressures find calm are searched (find_calm_islands())

  /// N, mean friction forces on all particles from the repulsions of the last step's V.4; state
  std::vector<Vec3> surface_friction_n;
  std::vector<Vec3> surface_friction,   ///< N, the same of I.3
      surface_friction_next;            ///< N, the same of this step's V.4
  ContactImpulses repulsion_impulses;   ///< scratch: impulses of I.3 or V.4 on all particles
  CollisionCandidates self_candidates;  ///< pairs of surface elements that may be near each other
  SelfRepulsion self_repulsion;         ///< self-repulsions of this step
  /// Pairs of surfaces that meet in this step, for contact inside the velocity solves.
  SelfRepulsion approaching_surfaces;
  SelfCollision self_collision;  ///< self-collisions

  std::vector<Vec3> mean_velocity;  ///< m/s, per particle, (x^{n+1} - x^n) / dt, from V.2 on
  std::vector<Vec3> force,          ///< N, per particle, forces that the step applies
      damping_force,                ///< N, per particle, damping forces of the last product; scratch
      force_in_single;              ///< N, per particle, sums in single precision; scratch of VelocitySystem
  /// m/s^2, (V - v) / dt of the last semi-implicit solve, in I.1 or V.2; the next one begins at v + dt a.
  /// State.
  GeneralizedVelocity acceleration;
  BlockJacobi block_jacobi;             ///< block-Jacobi preconditioner of the velocity solves
  Islands islands;                      ///< islands of the last velocity solve
  IslandSearch island_search;           ///< scratch of the velocity solves
  GeneralizedVelocity right_side,       ///< right side b of the solve at hand
      solution,                         ///< its solution V
      residual,                         ///< scratch of conjugate gradients
      direction,                        ///< scratch of conjugate gradients: search direction
      image;                            ///< scratch of conjugate gradients: operator times direction
  GeneralizedVelocity newton_residual,  ///< m/s, residual of Newton's method under the constraints
      unconstrained,                    ///< m/s, residual of Newton's method before its projection
      correction,                       ///< Newton's correction; also scratch
      preconditioned;                   ///< scratch: preconditioned residual
  VelocityBlocks blocks;                ///< block preconditioner of Newton's method
  VelocityFactor factor;                ///< preconditioner of Newton's method for stiff systems
  /// Per deformable body, whether its contact is inside the velocity solve in this step.
  ///
  /// The file sim/step/solved_bodies.cpp says which bodies are chosen.
  std::vector<char> solved_bodies;
  std::vector<char> holder;                  ///< scratch of that choice, per rigid body
  std::vector<std::array<int, 2>> touching;  ///< scratch of that choice: pairs of bodies in contact
  /// Islands of this step's contacts; those that are searched have contact inside their velocity solve.
  Islands solved;
  std::vector<CompositeBody> wholes;  ///< scratch, per island
  /// Impulse of pins and drag in the last solve with contact, for the ledger.
  Momentum solve_from_outside;
  Islands elastic,  ///< in implicit steps, islands of `solved` whose solve includes elasticity
      relaxing;     ///< in implicit steps, islands of `solved` whose strain relaxes slowly: no elasticity
  std::vector<char> is_solved;         ///< scratch, per island
  ContactForces contact_forces;        ///< contacts whose impulses are unknowns of the solve
  PairForces pair_forces_n,            ///< pairs of surfaces in the solve of the last step's V; state
      pair_forces,                     ///< the same of III
      pair_forces_next;                ///< the same of this step's V
  std::vector<Vec3> explicit_force;    ///< N, per particle, explicit forces of the last solve
  GeneralizedVelocity solved_change;   ///< m/s and rad/s, what the solve of step I has added
  GeneralizedVelocity start_velocity,  ///< m/s and rad/s, velocities before step V
      middle_velocity;                 ///< m/s and rad/s, velocities of step III
  FreeIslands free_islands;            ///< islands that keep their spin
  /// m/s, the sum 2 u + w - u' of keep_spin(), of particles and of the centers of rigid bodies alone.
  GeneralizedVelocity twice_moved;
  bool converged = true;          ///< true if the last implicit solve of I.1 converged
  bool contact_converged = true;  ///< true if this step's solves with contact converged
  std::vector<Mat3> inertia;      ///< kg m^2, world axes, per rigid body; scratch of VelocitySystem
};

/// A scene in memory: everything that a step reads and writes.
struct World {
  Bodies bodies;                ///< rigid and deformable bodies
  EffectSet plan;               ///< effects that the scene calls for
  Vec3 gravity = Vec3::Zero();  ///< m/s^2
  AppliedForces applied;        ///< forces from outside, besides those of the scene; no state
  StepSettings settings;        ///< settings of the solver
  /// Per deformable body, whether its slowest deformation has more than ten times critical damping.
  std::vector<char> strongly_damped;
  /// Per deformable body, the time in which strain relaxes, s: viscosity over stiffness of its material.
  std::vector<double> damping_time;
  bool may_crush = false;      ///< true if a deformable body is much heavier than a dynamic rigid one
  StepContext context;         ///< values of the step at hand
  StageClock clock;            ///< seconds and calls of stages in the frame
  StepCounters counters;       ///< counts of the frame
  StepLedger ledger;           ///< ledger of momentum and energy
  ContactTally contact_tally;  ///< impulses of contact in the frame, for output; no state
  StageHashes stage_hashes;    ///< hashes after each stage, if they are on

  /// Returns whether the plan has an effect.
  bool has(Effect effect) const { return plan[index(effect)]; }
  /// Returns whether bodies can collide with or touch each other.
  bool meets() const { return touches() || has(Effect::rigid_collision); }
  /// Returns whether bodies can be in contact with each other.
  bool touches() const { return has(Effect::rigid_contact) || has(Effect::rigid_deformable_contact); }
  /// Returns whether deformable bodies have elastic or damping forces.
  bool has_internal_forces() const {
    return has(Effect::deformable_elasticity) || has(Effect::springs) || has(Effect::bending);
  }
  /// Returns which pairs of bodies the search for contact candidates looks at.
  CandidateFilter contact_filter() const {
    return {has(Effect::rigid_collision) || has(Effect::rigid_contact), has(Effect::rigid_deformable_contact),
            settings.contact_reduction};
  }
};

}  // namespace duet
