// Everything a time step reads and writes.
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
#include "sim/contact/response/warm_start.h"
#include "sim/deformable/self_contact/self_collision.h"
#include "sim/deformable/self_contact/self_repulsion.h"
#include "sim/solve/conjugate_gradient.h"
#include "sim/solve/contact_forces.h"
#include "sim/solve/island_gradients.h"
#include "sim/solve/pressure_system.h"
#include "sim/solve/velocity_blocks.h"
#include "sim/solve/velocity_system.h"
#include "sim/step/composite_body.h"
#include "sim/step/effects.h"
#include "sim/step/free_islands.h"
#include "sim/step/kinematic_motion.h"
#include "sim/step/stage_clock.h"
#include "sim/step/stage_hashes.h"
#include "sim/step/step_ledger.h"

namespace duet {

struct StepSettings {
  bool implicit_elasticity = false;  // in I.1 and V.2, by Newton's method; else explicit
  int newton_iterations = 20;
  double cfl = 0.9;                 // time step over the elastic stability limit
  double max_travel = 0.1;          // into a moving rigid body a step, over its size
  double max_rotation = 0.314159;   // rad a step
  double max_time_step = 1.0 / 48;  // s
  double cg_tolerance = 1e-3;       // m/s
  int cg_iterations = 200;
  int projection_sweeps = 2;
  bool constraints_first = false;  // in step V, before the solve instead of after it
  OrientationUpdate orientation = OrientationUpdate::exact;
  bool keep_spin = true;  // of free islands with deformable bodies, as positions move
  bool contact_reduction = true;
  PushOutSettings push_out;  // without rigid_pairs, these are separated at all their contacts
  CollisionSettings collision;
  ContactSolveSettings contact;
  PressureSettings pressure;
};

// What a frame adds up over its steps.
struct StepCounters {
  std::int64_t cg_iterations = 0;
  std::int64_t pressure_iterations = 0;
  std::int64_t newton_iterations = 0;
  std::int64_t contact_sweeps = 0;
  std::int64_t contacts = 0;         // with an impulse, in the last step
  std::int64_t self_repulsions = 0;  // pairs nearer than their thickness, in the last step
  std::int64_t self_collisions = 0;  // impulses
  std::int64_t impact_zone_particles = 0;
};

// One step's own values: sizes, times, the paper's named velocities, scratch that keeps its storage.
struct StepContext {
  double dt = 0;    // s
  double time = 0;  // s, at the start of the step

  std::vector<Vec3> x_n;            // particle positions x^n
  std::vector<Vec3> x_next;         // x^{n+1} as predicted, for the contact of deformable surfaces
  std::vector<Vec3> x_half;         // x^{n+1/2} = (x^n + x^{n+1})/2, from V.2 on
  std::vector<RigidState> rigid_n;  // rigid states of time n
  VelocityState v_n;                // v^n
  VelocityState difference;         // v~^{n+1/2} - v^n
  VelocityState v_hat_n;            // v^^n, after collisions

  BroadPhase meeting;                    // of the choice of the time step
  std::vector<KinematicStep> kinematic;  // motions over this step

  JointSolver joints;
  FreeMotion free_motion;
  double joints_excess = 0;  // of FreeMotion
  ArticulatedResponse linked;
  std::vector<Pose> end_pose;                // of rigid bodies that are not dynamic, at x^{n+1}
  Momentum joints_from_outside;              // of finish_positions, for the ledger
  std::vector<Vec3> joint_push, joint_turn;  // N s, N m s: what joints gave each body in step III

  ContactSet contacts;
  ContactGraph graph;
  ContactSolveScratch contact_solve;
  ContactCache memory;  // of the last step that succeeded
  CollisionScratch collision_scratch;
  PushOutScratch push_out_scratch;
  SeparationScratch separation_scratch;
  ContactProjection projection;
  PressureScratch pressure;
  // Pa, of every one-ring, those by which the last step that succeeded kept velocities without divergence
  // (part of the state), and those of this step.
  std::vector<double> held_pressure, new_pressure;
  std::vector<char>
      rests;  // scratch: of every deformable body, whether its volumes change no faster than at rest

  CollisionCandidates self_candidates;
  SelfRepulsion self_repulsion;
  SelfRepulsion
      meeting_surfaces;  // of surfaces that meet in this step, for contact inside the velocity solves
  SelfCollision self_collision;

  std::vector<Vec3> force, damping_force, force_in_single;  // N; the last as VelocitySystem collects it
  // m/s^2, (V - v)/dt of the last semi-implicit solve, I.1's or V.2's: the next one begins at v + dt a. Part
  // of the state.
  GeneralizedVelocity acceleration;
  DampedMasses damped_masses;  // of the velocity solves
  Islands islands;             // of the last of them
  IslandSearch island_search;
  GeneralizedVelocity right_side, solution, residual, direction, image;
  GeneralizedVelocity imbalance, unconstrained, correction, preconditioned;  // of Newton's method
  VelocityBlocks blocks;                                                     // the same
  // Contact inside the velocity solves, of the islands of `solved` that are searched: those of deformable
  // bodies for which that is so in this step (sim/step/solved_bodies.cpp).
  std::vector<char> solved_bodies;           // of every deformable body
  std::vector<char> holder;                  // scratch of that choice: of every rigid body
  std::vector<std::array<int, 2>> touching;  // scratch of that choice
  Islands solved;
  std::vector<CompositeBody> wholes;  // scratch: of every island
  Momentum solve_from_outside;        // of pins and drag in the last solve with contact, for the ledger
  Islands elastic, relaxing;          // of those, in implicit steps: see solve_contact_halfway()
  std::vector<char> is_solved;        // scratch: of every island
  ContactForces contact_forces;
  std::vector<Vec3> explicit_force;                     // N, of the last semi-implicit solve
  GeneralizedVelocity solved_change;                    // m/s, of step I: what its solve has added
  GeneralizedVelocity start_velocity, middle_velocity;  // m/s, before step V, and of step III
  FreeIslands free_islands;
  // m/s, 2 u + w - u' of keep_spin(): of particles and, as `rigid`, of the centres of rigid bodies.
  VelocityState twice_moved;
  bool balanced = true;  // whether it has converged
  std::vector<Mat3> inertia;
};

struct World {
  Bodies bodies;
  EffectSet plan;
  Vec3 gravity = Vec3::Zero();  // m/s^2
  StepSettings settings;
  // Of every deformable body: whether its slowest deformation is damped for more than ten times the critical
  // damping; and the time in which strain relaxes, s: the material's viscosity over its stiffness.
  std::vector<char> strongly_damped;
  std::vector<double> damping_time;
  bool may_crush = false;  // whether a deformable one is much heavier than a rigid one
  StepContext context;
  StageClock clock;
  StepCounters counters;
  StepLedger ledger;
  StageHashes stage_hashes;

  bool has(Effect effect) const { return plan[index(effect)]; }
  // Whether bodies can run into each other.
  bool meets() const { return touches() || has(Effect::rigid_collision); }
  bool touches() const { return has(Effect::rigid_contact) || has(Effect::rigid_deformable_contact); }
  bool has_internal_forces() const {
    return has(Effect::deformable_elasticity) || has(Effect::springs) || has(Effect::bending);
  }
  CandidateFilter contact_filter() const {
    return {has(Effect::rigid_collision) || has(Effect::rigid_contact), has(Effect::rigid_deformable_contact),
            settings.contact_reduction};
  }
};

}  // namespace duet
