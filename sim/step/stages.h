// The stages of a time step: their names in the code, and the functions that do their work.
//
// Paper: Shinar, Schroeder, Fedkiw, Two-way Coupling of Rigid and Deformable Bodies, SCA 2008. The numbers
// are those of its sections 3 to 7. The table of sim/step/stage_table.h says in which order the stages run,
// under which conditions, and how statistics call them.
#pragma once

namespace duet {

struct World;
struct StepContext;

/// The stages of a time step, in the order of the table.
///
/// A stage has one label, one clock and one line of the ledger.
enum class Stage {
  time_step_choice,  ///< choice of the length of the step, before it
  kinematic_motion,  ///< plan_motion()
  joint_rows,        ///< begin_joints()
  repulsion_pairs,   ///< find_repulsions()

  advance_velocity,        ///< I.1, advance_velocity()
  volume_correction,       ///< I.2, correct_volume()
  self_repulsion,          ///< I.3, repel_surfaces()
  air_drag_halfway,        ///< slow_in_air_halfway()
  applied_forces_halfway,  ///< push_bodies_halfway()

  contact_candidates,  ///< find_contacts()
  back_to_start,       ///< return_to_start()
  collisions,          ///< II.1, collide()
  collided_joints,     ///< II.2, stabilize_collided()
  re_evolution,        ///< II.3, evolve_again()

  contact_graph,      ///< III.1, find_contact_graph()
  solved_islands,     ///< leave_contact_to_solve()
  warm_start,         ///< start_contact_warm()
  control,            ///< III.2, control_joints()
  contact,            ///< III.3, apply_contact()
  contact_in_solve,   ///< solve_contact_halfway()
  volume_in_contact,  ///< correct_volume_in_contact()
  turn_of_joints,     ///< joints_turn_too_far()

  advance_position,    ///< IV.1, advance_position()
  push_out,            ///< IV.2, push_out()
  back_to_collided,    ///< return_to_collided()
  post_stabilization,  ///< IV.3, finish_positions()
  energy_of_joints,    ///< joints_miss_energy()
  air_drag,            ///< slow_in_air()
  applied_forces,      ///< push_bodies()
  embedded_particles,  ///< follow_bones()
  self_collision,      ///< collide_surfaces()

  repulsion_pairs_at_end,   ///< find_repulsions()
  spin_at_start,            ///< begin_spin()
  solve_constraints,        ///< find_solve_constraints()
  middle_forces,            ///< find_middle_forces()
  constrained_solve,        ///< V.2, constrained_solve()
  re_evaluation,            ///< V.3, evaluate_again()
  contact_in_solve_at_end,  ///< solve_contact_at_end()
  make_incompressible,      ///< V.1, make_incompressible()
  spin,                     ///< keep_spin()
  contacts_at_end,          ///< prepare_contacts_at_end()
  control_at_end,           ///< V.4, control_joints_at_end()
  contact_at_end,           ///< V.4, apply_contact_at_end()
  repulsion_at_end,         ///< V.4, repel_surfaces_at_end()
  volume_at_end,            ///< keep_volume()
  damping_at_end,           ///< damp_at_end()

  elastic_forces,     ///< evaluation of elastic forces; timed within other stages
  damping_solve,      ///< conjugate gradients of velocity solves; timed within other stages
  shock_propagation,  ///< shock propagation; timed within other stages
  joints,             ///< solution for joints beside contact; timed within other stages
};

// The functions of the stages. Each works on the world and on the step's own values, which are world.context,
// so that tests can look between two of them. `v` are the velocities of all bodies, `x` their positions and
// orientations.

/// Evaluates the prescribed motion of kinematic bodies over this step: sets context.kinematic.
void plan_motion(World& world, StepContext& context);
/// Sets the rows of all joints at x^n, and plans the rates of controlled joints over the step.
void begin_joints(World& world, StepContext& context);

/// I.1: v^n -> v_*^{n+1/2} = v^n + dt/2 a, by gravity, elastic and damping forces.
void advance_velocity(World& world, StepContext& context);
/// I.2: v_*^{n+1/2} -> v_**^{n+1/2}, so that nodal volumes (one-rings) reach their rest volumes at x^{n+1}.
void correct_volume(World& world, StepContext& context);
/// I.3: v_**^{n+1/2} -> v~^{n+1/2}, by impulses between deformable surfaces that are near each other.
void repel_surfaces(World& world, StepContext& context);
/// Slows v~^{n+1/2} of bodies with a terminal speed by the air drag of half a step.
void slow_in_air_halfway(World& world, StepContext& context);
/// Adds the impulses of applied forces over half a step to v~^{n+1/2}.
void push_bodies_halfway(World& world, StepContext& context);

/// Collects all contacts that may be reached within the step at v~^{n+1/2}: sets context.contact.contacts.
void find_contacts(World& world, StepContext& context);
/// Stores v~^{n+1/2} - v^n in context.states.difference, and gives the bodies v^n back.
void return_to_start(World& world, StepContext& context);
/// II.1: v^n -> v_*^n, by collisions.
void collide(World& world, StepContext& context);
/// II.2: v_*^n -> v^^n, by post-stabilization, so that collisions take no joint apart.
void stabilize_collided(World& world, StepContext& context);
/// II.3: v^^{n+1/2} = v^^n + (v~^{n+1/2} - v^n). Stores v^^n in context.states.v_hat_n.
void evolve_again(World& world, StepContext& context);

/// III.1: finds the order in which contact visits bodies, and the targets of contacts.
void find_contact_graph(World& world, StepContext& context);
/// Finds the islands with contact inside their velocity solve, and deactivates their pairs for the sweeps.
void leave_contact_to_solve(World& world, StepContext& context);
/// Warm start: applies to v^^{n+1/2} the impulses that contacts had in the last step.
void start_contact_warm(World& world, StepContext& context);
/// III.2: v^^{n+1/2} -> v_*^{n+1/2}, by joints and their control.
void control_joints(World& world, StepContext& context);
/// III.3: v_*^{n+1/2} -> v^{n+1/2}, by contact and pre-stabilization of joints.
void apply_contact(World& world, StepContext& context);
/// Solves for v^{n+1/2} of the islands with contact inside their velocity solve.
void solve_contact_halfway(World& world, StepContext& context);
/// Changes v^{n+1/2} so that nodal volumes reach their rest volumes under the contacts of this step.
void correct_volume_in_contact(World& world, StepContext& context);
/// Returns whether jointed bodies turn farther by v^{n+1/2} than the time-step rule foresaw.
bool joints_turn_too_far(const World& world, const StepContext& context);

/// IV.1: x^n -> x^^{n+1} = x^n + dt v^{n+1/2}.
void advance_position(World& world, StepContext& context);
/// IV.2: x^^{n+1} -> x^{n+1}, interpenetration resolution.
void push_out(World& world, StepContext& context);
/// Drops v^{n+1/2}, and gives the bodies v^^n back at x^{n+1}.
void return_to_collided(World& world, StepContext& context);
/// IV.3: v^^n -> v-^n, by post-stabilization, so that joints keep together at x^{n+1}.
void finish_positions(World& world, StepContext& context);
/// Returns whether the joints miss so much of the energy of the motion between them that a shorter step
/// helps.
bool joints_miss_energy(const World& world, const StepContext& context);
/// Slows v-^n of bodies with a terminal speed by the air drag of the whole step.
void slow_in_air(World& world, StepContext& context);
/// Adds the impulses of applied forces over the whole step to v-^n.
void push_bodies(World& world, StepContext& context);
/// Moves the particles that dynamic bodies carry to their positions at x^{n+1}, and sets their velocities.
void follow_bones(World& world, StepContext& context);
/// Changes x^{n+1} so that no deformable surfaces have crossed, and v-^n by that change over dt.
void collide_surfaces(World& world, StepContext& context);

/// Finds the pairs of deformable surfaces that are near each other at the positions x: x^n or x^{n+1}.
void find_repulsions(World& world, StepContext& context);
/// Does so at x^n, and chooses the layers under a load, see choose_pressed_layers().
void find_repulsions_at_start(World& world, StepContext& context);
/// Finds the free islands with deformable bodies, and stores the velocities that keep_spin() compares with.
void begin_spin(World& world, StepContext& context);
/// V.2: finds the constraints P at x^{n+1}: contacts that hold an impulse, joints and self-repulsions.
void find_solve_constraints(World& world, StepContext& context);
/// V.2: evaluates gravity and elastic forces F at x^{n+1/2} = (x^n + x^{n+1})/2.
void find_middle_forces(World& world, StepContext& context);
/// V.2: solves V = v-^n + theta dt M^-1 (F + F_damping(V)) under P, where theta is solver.damping_at, and
/// keeps F + F_damping(V).
void constrained_solve(World& world, StepContext& context);
/// V.3: v_**^{n+1} = v-^n + dt M^-1 (F + F_damping(V)) without P; kinematic bodies take v^{n+1}.
void evaluate_again(World& world, StepContext& context);
/// Solves for v_**^{n+1} of the islands with contact inside their velocity solve.
void solve_contact_at_end(World& world, StepContext& context);
/// V.1: makes v_**^{n+1} free of divergence at x^{n+1}, by pressures.
void make_incompressible(World& world, StepContext& context);
/// Turns v_**^{n+1} of free islands back by the spin that moving the positions has given them.
void keep_spin(World& world, StepContext& context);

/// Brings the contacts of step III to x^{n+1}, and starts v_**^{n+1} with twice their impulses.
void prepare_contacts_at_end(World& world, StepContext& context);
/// V.4: changes v_**^{n+1} by post-stabilization of joints and their control.
void control_joints_at_end(World& world, StepContext& context);
/// V.4: changes v_**^{n+1} by contact with friction and post-stabilization.
void apply_contact_at_end(World& world, StepContext& context);
/// V.4: applies impulses between deformable surfaces that are near each other.
void repel_surfaces_at_end(World& world, StepContext& context);
/// Makes v^{n+1} free of divergence under the contacts of V.4.
void keep_volume(World& world, StepContext& context);
/// Applies damping under the contacts of V.4, if constraints come before the solve.
void damp_at_end(World& world, StepContext& context);

}  // namespace duet
