// Everything that a time step reads and writes: settings, state, scratch and counters.
#pragma once

#include "sim/contact/detection/contact_candidates.h"
#include "sim/contact/push_out/push_out.h"
#include "sim/contact/response/collisions.h"
#include "sim/contact/response/contact_solver.h"
#include "sim/solve/pressure_system.h"
#include "sim/step/applied_forces.h"
#include "sim/step/contact_tally.h"
#include "sim/step/effects.h"
#include "sim/step/stage_clock.h"
#include "sim/step/stage_hashes.h"
#include "sim/step/step_context.h"
#include "sim/step/step_ledger.h"

namespace duet {

/// The settings of the solver.
struct StepSettings {
  /// True if I.1 solves for elasticity by Newton's method, and V takes its forces of the middle; otherwise
  /// elasticity is explicit.
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
  double cg_tolerance = 1e-3;  ///< m/s, largest residual of a velocity solve, for the size of the bodies
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
  LastStep last_step;          ///< what the last step leaves to the next one; state
  StepContext context;         ///< values of the step at hand; no state
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
