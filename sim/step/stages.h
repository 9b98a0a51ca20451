// The stages of a time step: their names in the code, and the functions that do their work.
//
// Paper: Shinar, Schroeder, Fedkiw, Two-way Coupling of Rigid and Deformable Bodies, SCA 2008. The numbers
// are those of its sections 3 to 7. In which order the stages run, under which conditions, and what each of
// them is called in statistics is said in one place: the table of sim/step/stage_table.h.
#pragma once

namespace duet {

struct World;
struct StepContext;

/// In the order of the table. A name stands for one label, one clock and one line of the ledger.
enum class Stage {
  time_step_choice,  // before the step
  kinematic_motion,
  joint_rows,

  advance_velocity,   // I.1
  volume_correction,  // I.2
  self_repulsion,     // I.3
  air_drag_halfway,

  contact_candidates,
  back_to_start,
  collisions,       // II.1
  collided_joints,  // II.2
  re_evolution,     // II.3

  contact_graph,  // III.1
  solved_islands,
  warm_start,
  control,  // III.2
  contact,  // III.3
  contact_in_solve,
  volume_in_contact,
  turn_of_joints,

  advance_position,  // IV.1
  push_out,          // IV.2
  back_to_collided,
  post_stabilization,  // IV.3
  energy_of_joints,
  air_drag,
  embedded_particles,
  self_collision,

  repulsion_pairs,
  spin_at_start,
  solve_constraints,
  middle_forces,
  constrained_solve,  // V.2
  re_evaluation,      // V.3
  contact_in_solve_at_end,
  make_incompressible,  // V.1
  spin,
  contacts_at_end,
  control_at_end,    // V.4
  contact_at_end,    // V.4
  repulsion_at_end,  // V.4
  volume_at_end,
  damping_at_end,

  elastic_forces,  // these are timed within other stages
  damping_solve,
  shock_propagation,
  joints,
};

// What the stages do. Each works on the world and on the step's own values, which are world.context, so that
// tests can look between two of them. `v` are the velocities of all bodies, `x` their positions and
// orientations.

/// Prescribed motion of kinematic bodies over this step.
void plan_motion(World& world, StepContext& context);
/// Rows of all joints at x^n, and the rates that controlled joints are to have.
void begin_joints(World& world, StepContext& context);

/// I.1: v^n -> v_*^{n+1/2} = v^n + dt/2 a.
void advance_velocity(World& world, StepContext& context);
/// I.2: v_*^{n+1/2} -> v_**^{n+1/2}, so that one-rings reach their rest volumes at x^{n+1}.
void correct_volume(World& world, StepContext& context);
/// I.3: v_**^{n+1/2} -> v~^{n+1/2}, by impulses between deformable surfaces that are near each other.
void repel_surfaces(World& world, StepContext& context);
/// v~^{n+1/2} of bodies with a terminal speed.
void slow_in_air_halfway(World& world, StepContext& context);

/// What may touch within the step, by v~^{n+1/2}.
void find_contacts(World& world, StepContext& context);
/// Keeps v~^{n+1/2} - v^n and gives the bodies v^n back.
void return_to_start(World& world, StepContext& context);
/// II.1: v^n -> v_*^n.
void collide(World& world, StepContext& context);
/// II.2: v_*^n -> v^^n, so that collisions take no joint apart.
void stabilize_collided(World& world, StepContext& context);
/// II.3: v^^{n+1/2} = v^^n + (v~^{n+1/2} - v^n). Keeps v^^n.
void evolve_again(World& world, StepContext& context);

/// III.1: the order in which contact visits bodies, and the targets of contacts.
void find_contact_graph(World& world, StepContext& context);
/// The islands whose contact is part of their velocity solve; no sweep visits them.
void leave_contact_to_solve(World& world, StepContext& context);
/// v^^{n+1/2} with the impulses that contacts had in the last step.
void start_contact_warm(World& world, StepContext& context);
/// III.2: v^^{n+1/2} -> v_*^{n+1/2}: joints and their control.
void control_joints(World& world, StepContext& context);
/// III.3: v_*^{n+1/2} -> v^{n+1/2}: contact, and pre-stabilization of joints.
void apply_contact(World& world, StepContext& context);
/// v^{n+1/2} of the islands whose contact is part of their velocity solve.
void solve_contact_halfway(World& world, StepContext& context);
/// v^{n+1/2}, so that one-rings reach their rest volumes between the contacts of this step.
void correct_volume_in_contact(World& world, StepContext& context);
/// Whether jointed bodies turn farther by v^{n+1/2} than the rule for the time step foresaw.
bool joints_turn_too_far(const World& world, const StepContext& context);

/// IV.1: x^n -> x^^{n+1} = x^n + dt v^{n+1/2}.
void advance_position(World& world, StepContext& context);
/// IV.2: x^^{n+1} -> x^{n+1}, interpenetration resolution.
void push_out(World& world, StepContext& context);
/// Drops v^{n+1/2} and gives the bodies v^^n back, at x^{n+1}.
void return_to_collided(World& world, StepContext& context);
/// IV.3: v^^n -> v-^n, so that joints keep together at x^{n+1}.
void finish_positions(World& world, StepContext& context);
/// Whether the joints lack more of the energy of the motion between them than a shorter step would leave.
bool joints_miss_energy(const World& world, const StepContext& context);
/// v-^n of bodies with a terminal speed.
void slow_in_air(World& world, StepContext& context);
/// Places and velocities of the particles that bones carry.
void follow_bones(World& world, StepContext& context);
/// x^{n+1} without crossings of deformable surfaces, v-^n with the change.
void collide_surfaces(World& world, StepContext& context);

/// The pairs of deformable surfaces that are near each other at x^{n+1}.
void find_repulsions(World& world, StepContext& context);
/// Of free islands with deformable bodies, what keep_spin() compares with.
void begin_spin(World& world, StepContext& context);
/// V.2: the constraints P of contacts that hold an impulse, of joints and of repulsions, at x^{n+1}.
void find_solve_constraints(World& world, StepContext& context);
/// V.2: gravity and elastic forces F at x^{n+1/2} = (x^n + x^{n+1})/2.
void find_middle_forces(World& world, StepContext& context);
/// V.2: V = v-^n + dt/2 M^-1 (F + F_damping(V)) under P, and F + F_damping(V).
void constrained_solve(World& world, StepContext& context);
/// V.3: v_**^{n+1} = v-^n + dt M^-1 (F + F_damping(V)) without P; kinematic bodies take v^{n+1}.
void evaluate_again(World& world, StepContext& context);
/// v_**^{n+1} of the islands whose contact is part of their velocity solve.
void solve_contact_at_end(World& world, StepContext& context);
/// V.1: v_**^{n+1} without divergence at x^{n+1}.
void make_incompressible(World& world, StepContext& context);
/// v_**^{n+1} of free islands, turned back by the spin that moving the positions has given them.
void keep_spin(World& world, StepContext& context);

/// The contacts of step III at x^{n+1}, and v_**^{n+1} with the impulses that they had.
void prepare_contacts_at_end(World& world, StepContext& context);
/// V.4: post-stabilization of joints, and their control.
void control_joints_at_end(World& world, StepContext& context);
/// V.4: contact with friction, and post-stabilization.
void apply_contact_at_end(World& world, StepContext& context);
/// V.4: impulses between deformable surfaces.
void repel_surfaces_at_end(World& world, StepContext& context);
/// v^{n+1} without divergence between the contacts of V.4.
void keep_volume(World& world, StepContext& context);
/// Where constraints come before the solve: damping, under the contacts of V.4.
void damp_at_end(World& world, StepContext& context);

}  // namespace duet
