// The values of one time step, in a part for each group of stages, and what a step leaves to the next one.
#pragma once

#include "sim/articulation/free_motion.h"
#include "sim/articulation/joint_solver.h"
#include "sim/base/disjoint_sets.h"
#include "sim/contact/detection/broad_phase.h"
#include "sim/contact/graph/contact_graph.h"
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
#include "sim/step/composite_body.h"
#include "sim/step/free_islands.h"
#include "sim/step/kinematic_motion.h"

namespace duet {

/// Forces on all rigid bodies, or nothing.
struct RigidForces {
  std::vector<Vec3> linear,  ///< N, at the center of mass
      angular;               ///< N m, about the center of mass, world axes
};

/// What a step leaves to the next one, besides positions and velocities: warm starts, and forces that solves
/// assume as known. It is state, which checkpoints and hashes contain. A step that fails or is refused leaves
/// it as it is, but for `acceleration` and `control_angle`.
struct LastStep {
  /// m/s^2, (V - v) / dt of the last semi-implicit solve, in I.1 or V.2; the next one begins at v + dt a.
  GeneralizedVelocity acceleration;
  ContactCache contact_cache;          ///< contacts that held an impulse at the end of the last step
  PairForces pair_forces;              ///< pairs of surfaces in the velocity solve of the last V
  std::vector<Vec3> surface_friction;  ///< N, mean friction forces on all particles from repulsions in V.4
  /// Forces of control, friction and limits of joints in the last V.
  RigidForces joint_drive;
  std::vector<double> control_angle;  ///< rad, per joint, with whole turns, see control_rates()
  std::vector<double> pressure;       ///< Pa, per one-ring, which kept v^{n+1} free of divergence
};

/// The paper's named states of a step.
struct PaperStates {
  std::vector<Vec3> x_n;            ///< m, particle positions x^n
  std::vector<Vec3> x_next;         ///< m, predicted x^{n+1}, for the contact of deformable surfaces
  std::vector<Vec3> x_half;         ///< m, x^{n+1/2} = (x^n + x^{n+1}) / 2, from V.2 on; see AtMiddle
  std::vector<RigidState> rigid_n;  ///< rigid states of time n; from IV.1 on with the delays of the step
  VelocityState v_n;                ///< v^n
  VelocityState difference;         ///< v~^{n+1/2} - v^n
  VelocityState v_hat_n;            ///< v^^n, after collisions
};

/// Scratch of the choice of the time step.
struct TimeStepScratch {
  BroadPhase meeting;               ///< pairs that can meet
  std::vector<char> hangs;          ///< whether a rigid body hangs on joints from a body that is not dynamic
  std::vector<char> jointed_balls;  ///< whether a rigid body is a ball with joints and restitution
};

/// Joints and control: II.2, III.2, III.3, IV.3 and V.4.
struct JointStage {
  JointSolver solver;                 ///< joints, with their rows as of the last update
  FreeMotion free_motion;             ///< energy of jointed bodies as positions advance
  double excess = 0;                  ///< FreeMotion::Outcome::excess of this step
  ArticulatedResponse response;       ///< how groups of jointed bodies respond to contact impulses
  Momentum from_outside;              ///< what fixed bodies gave through joints in IV.3, for the ledger
  std::vector<Vec3> push,             ///< N s, impulse of joints on each rigid body in step III
      turn;                           ///< N m s, angular impulse of joints on each rigid body in step III
  RigidForces drive,                  ///< forces of control, friction and limits of joints of III, then of V
      swept_drive;                    ///< those of III outside the velocity solves
  std::vector<DriveRow> drive_rows;   ///< scratch: rows of control, friction and limits of joints
  std::vector<double> drive_impulse,  ///< N s or N m s, per row of joints: its impulse in III
      swept_impulse;                  ///< the same, zero for rows inside a velocity solve
  JointForces forces;                 ///< those of islands with contact inside their velocity solve
};

/// Collisions, contact and interpenetration resolution: II.1, III, IV.2 and V.4.
struct ContactStage {
  ContactSet contacts;                     ///< contacts of this step
  ContactGraph graph;                      ///< order in which contact visits them
  std::vector<ContactFrame> first_frames;  ///< frames of the contacts in step III
  CollisionScratch collisions;             ///< scratch of II.1
  ContactSolveScratch solve;               ///< scratch of the contact solver
  PushOutScratch push_out;                 ///< scratch of IV.2
  SeparationScratch separation;            ///< scratch of IV.2 between rigid bodies
  double parting_work = 0;  ///< J, potential energy that IV.2 has given bodies that overlap since the start
};

/// Contact between deformable surfaces: I.3, self-collisions in IV, and V.4.
struct SurfaceStage {
  std::vector<Vec3> friction,      ///< N, mean friction forces on all particles from the repulsions of I.3
      friction_next;               ///< N, the same of this step's V.4
  ContactImpulses impulses;        ///< scratch: impulses of I.3 or V.4 on all particles
  CollisionCandidates candidates;  ///< pairs of surface elements that may be near each other
  SelfRepulsion repulsion;         ///< self-repulsions of this step
  SelfRepulsion approaching;       ///< pairs that meet in this step, for contact inside the velocity solves
  SelfCollision collision;         ///< self-collisions
};

/// The velocity solves of I.1, III, V.2, V.3 and V.4: right sides, solutions and scratch.
struct VelocitySolve {
  ContactProjection projection;     ///< constraints of the solve at hand
  std::vector<Vec3> force,          ///< N, per particle, forces that the step applies
      explicit_force,               ///< N, per particle, explicit forces of the last solve
      damping_force,                ///< N, per particle, damping forces of the last product; scratch
      force_in_single;              ///< N, per particle, sums in single precision; scratch of VelocitySystem
  std::vector<Mat3> inertia;        ///< kg m^2, world axes, per rigid body; scratch of VelocitySystem
  std::vector<Vec3> mean_velocity;  ///< m/s, per particle, (x^{n+1} - x^n) / dt, from V.2 on
  GeneralizedVelocity right_side,   ///< right side b of the solve at hand
      solution,                     ///< its solution V
      solved_change;                ///< m/s and rad/s, what the solve of step I has added
  BlockJacobi block_jacobi;         ///< block-Jacobi preconditioner of semi-implicit solves
  Islands islands;                  ///< islands of the last velocity solve
  IslandSearch island_search;       ///< scratch of semi-implicit solves
  GeneralizedVelocity residual,     ///< scratch of conjugate gradients
      direction,                    ///< scratch of conjugate gradients: search direction
      image;                        ///< scratch of conjugate gradients: operator times direction
  GeneralizedVelocity newton_residual,  ///< m/s, residual of Newton's method under the constraints
      unconstrained,                    ///< m/s, residual of Newton's method before its projection
      correction,                       ///< Newton's correction; also scratch
      preconditioned;                   ///< scratch: preconditioned residual
  VelocityBlocks blocks;                ///< block preconditioner of Newton's method
  VelocityFactor factor;                ///< preconditioner of Newton's method for stiff systems
  bool converged = true;                ///< true if the last implicit solve of I.1 converged
};

/// Scratch of the search for layers under a load (sim/step/pressed_layers.cpp).
struct LayerSearch {
  /// What is known of one deformable body, and of its group for the first body of each.
  struct Layer {
    bool has_pair = false,         ///< true if its surface is near another one, and one of the two is thin
        touches = false,           ///< true if a rigid body touches it
        has_thin_contact = false;  ///< true if a rigid body touches a sheet or rod of the group there
    int last_host = -1;            ///< the last rigid body that was counted
    double load = 0,               ///< kg, mass of dynamic rigid bodies that touch it, and of volumes
        lightest = 0;              ///< kg, mass of the lightest sheet or rod
  };
  DisjointSets sets;           ///< groups of deformable bodies
  std::vector<char> has_pair;  ///< per particle, whether its surface is near another one
  std::vector<Layer> layers;   ///< per deformable body
};

/// Contact inside the velocity solves of III and V.
struct SolvedContact {
  /// Per deformable body, whether its contact is inside the velocity solve in this step.
  ///
  /// The file sim/step/solved_bodies.cpp says which bodies are chosen.
  std::vector<char> bodies;
  LayerSearch layers;                        ///< scratch of that choice
  std::vector<char> holder;                  ///< scratch of that choice, per rigid body
  std::vector<std::array<int, 2>> touching;  ///< scratch of that choice: pairs of bodies in contact
  /// Islands of this step's contacts; those that are searched have contact inside their velocity solve.
  Islands islands;
  Islands elastic,  ///< in implicit steps, those of `islands` whose solve includes elasticity
      relaxing;     ///< in implicit steps, those of `islands` whose strain relaxes slowly: no elasticity
  std::vector<char> is_searched;       ///< scratch, per island
  std::vector<CompositeBody> wholes;   ///< scratch, per island
  ContactForces forces;                ///< contacts whose impulses are unknowns of the solve
  PairForces pair_forces,              ///< pairs of surfaces in the solve of III
      pair_forces_next;                ///< the same of this step's V
  GeneralizedVelocity start_velocity,  ///< m/s and rad/s, velocities before step V
      middle_velocity;                 ///< m/s and rad/s, velocities of step III
  Momentum from_outside;               ///< impulse of pins and drag in the last solve, for the ledger
  bool converged = true;               ///< true if this step's solves with contact converged
};

/// Incompressibility: I.2, III.3 and V.1.
struct PressureStage {
  PressureScratch scratch;   ///< scratch of pressure solves
  std::vector<double> next;  ///< Pa, per one-ring, which keep v^{n+1} of this step free of divergence
  std::vector<char> rests;  ///< scratch, per deformable body: whether its volumes change as slowly as at rest
  Islands calm;  ///< scratch; the islands that pressures find calm are searched (find_calm_islands())
};

/// The angular momentum of free islands in V, see keep_spin().
struct SpinStage {
  FreeIslands islands;  ///< islands that keep their spin
  /// m/s, the sum 2 u + w - u' of keep_spin(), of particles and of the centers of rigid bodies alone.
  GeneralizedVelocity twice_moved;
};

/// One step's own values: its length and motions, and a part for each group of stages. Their scratch keeps
/// its storage from step to step. No part is state: LastStep has what the next step reads.
struct StepContext {
  double dt = 0;                         ///< s, length of the step
  double time = 0;                       ///< s, at the start of the step
  std::vector<KinematicStep> kinematic;  ///< motions of kinematic bodies over this step
  std::vector<Pose> end_pose;            ///< poses at x^{n+1}, of rigid bodies that are not dynamic

  PaperStates states;       ///< positions and velocities by the paper's names
  TimeStepScratch choice;   ///< scratch of choose_time_step()
  JointStage joints;        ///< joints and control
  ContactStage contact;     ///< collisions, contact and interpenetration resolution
  SurfaceStage surfaces;    ///< contact between deformable surfaces
  VelocitySolve solve;      ///< velocity solves
  SolvedContact solved;     ///< contact inside the velocity solves
  PressureStage pressures;  ///< incompressibility
  SpinStage spin;           ///< angular momentum of free islands
};

}  // namespace duet
