// The time step (paper section 2) on one page: a table of the stages in the order in which they run.
//
// step() goes through this table from top to bottom. The names and counts of stages in statistics, the
// ledger, `duet explain` and the hashes of stages are made from it. sim/step/README.md explains every stage,
// and tests/unit/step/stage_table_test.cpp compares its list of stages with this table.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "sim/step/effects.h"
#include "sim/step/stages.h"

namespace duet {

/// How a stage relates to the paper.
enum class Origin : char {
  paper = '=',  ///< as in the paper
  other = '~',  ///< in the paper too, here by another method or in another order
  added = '+',  ///< the paper has no such stage
};

/// The kind of change that a stage makes to bodies; the ledger of momentum counts the stage by it.
enum class Changes {
  nothing,    ///< no positions and velocities, except those of particles that other bodies carry
  half_step,  ///< velocities towards v^{n+1/2}, which moves the bodies and is dropped in step IV
  exchange,   ///< velocities, replaced by others that the step has kept
  velocity,   ///< velocities towards v^{n+1}, by impulses
  position,   ///< positions, or velocities that make up for the momentum that moving positions costs
};

/// The two orders of step V, as a condition of a stage.
enum class ConstraintOrder {
  both,          ///< the stage runs in both orders
  after_solve,   ///< V.4 sees all forces (paper section 7)
  before_solve,  ///< V.4 sees the explicit forces only, and damping acts after it (paper section 7.2)
};

/// A set of effects as bits: bit i stands for the effect with the number i.
using EffectMask = std::uint32_t;
static_assert(effect_count <= 32);

/// Returns the set of the given effects.
template <class... Effects>
constexpr EffectMask mask(Effects... effects) {
  return (EffectMask{0} | ... | (EffectMask{1} << static_cast<unsigned>(effects)));
}

/// When a stage runs: every condition has to hold.
struct Needs {
  EffectMask any = 0;      ///< effects of which the plan must have at least one; 0: no condition
  EffectMask and_any = 0;  ///< further effects of which the plan must have at least one; 0: no condition
  ConstraintOrder order = ConstraintOrder::both;  ///< the order of step V in which the stage runs
  /// Condition on settings and materials; null: no condition.
  bool (*when)(const World&) = nullptr;
};

/// Who runs a stage.
enum class Timing {
  by_step,        ///< step(), at its place in the table
  within_others,  ///< other stages, whose seconds include its seconds
  before_step,    ///< the caller of step()
};

/// A line of the table.
struct StageRow {
  Stage stage;             ///< the stage
  std::string_view label;  ///< its name in statistics; begins with the number of the paper's step
  Origin origin;           ///< its relation to the paper
  Needs needs;             ///< when it runs
  Changes changes;         ///< what it changes
  /// The function that does its work; null for checks, and for stages that step() does not run.
  void (*work)(World&, StepContext&) = nullptr;
  /// The check of a row without work: returns whether the step is too long.
  ///
  /// It is only called if a step may be refused; null: no check.
  bool (*is_too_long)(const World&, const StepContext&) = nullptr;
  Timing timing = Timing::by_step;  ///< who runs the stage
};

/// Returns whether some bodies may have contact inside their velocity solve (sim/step/solved_bodies.cpp).
bool solves_contact(const World& world);
/// Returns whether free islands keep their spin (sim/step/keep_spin.cpp).
bool keeps_spin(const World& world);
/// Returns whether pressures of incompressible bodies act once more after contact.
///
/// They do not in implicit steps, which have contact inside their solves.
bool keeps_volume_in_contact(const World& world);
/// Returns whether damping forces are solved for in step V.
///
/// They are not in implicit steps, which take the forces of their middle, found by I.1.
bool solves_at_end(const World& world);
/// Returns whether forces from outside act (sim/step/applied_forces.h).
bool has_applied_forces(const World& world);

/// The rows of the table, and the names that keep them short.
namespace stage_page {

using enum Origin;
using enum Changes;
using enum ConstraintOrder;

/// Bodies can be in contact.
constexpr EffectMask touching = mask(Effect::rigid_contact, Effect::rigid_deformable_contact);
/// Bodies can collide or be in contact.
constexpr EffectMask meeting = touching | mask(Effect::rigid_collision);
/// Rigid bodies have joints.
constexpr EffectMask jointed = mask(Effect::articulation);
/// Deformable bodies have internal forces.
constexpr EffectMask elastic = mask(Effect::deformable_elasticity, Effect::springs, Effect::bending);
/// Bodies keep their volume.
constexpr EffectMask incompressible = mask(Effect::incompressibility);
/// Rigid bodies carry particles of deformable bodies, or hold them by springs.
constexpr EffectMask bones = mask(Effect::hard_bindings, Effect::soft_bindings);

/// No condition.
constexpr Needs always{};
/// One of several effects.
constexpr Needs any(EffectMask effects, ConstraintOrder order = both) { return {effects, 0, order}; }
/// One effect.
constexpr Needs effect(Effect needed) { return {mask(needed)}; }
/// Incompressible bodies whose pressures act once more after contact.
constexpr Needs volume_in_contact(ConstraintOrder order) {
  return {touching, incompressible, order, keeps_volume_in_contact};
}
/// Forces or pressures for which step V solves.
constexpr Needs last_solve{elastic | incompressible, 0, after_solve, solves_at_end};
/// Contact inside velocity solves.
constexpr Needs solved_contact{elastic, 0, both, solves_contact};
/// Forces from outside.
constexpr Needs applied{0, 0, both, has_applied_forces};
/// Free islands that keep their spin.
constexpr Needs spin(ConstraintOrder order) { return {elastic, 0, order, keeps_spin}; }

// clang-format off
/// The table; see stage_table.
inline constexpr auto rows = std::to_array<StageRow>({
  // Before the step, and its preparation at x^n
  {Stage::time_step_choice,     "time step choice",                    other, always, nothing,   nullptr, nullptr, Timing::before_step},
  {Stage::kinematic_motion,     "0 kinematic motion",                  added, effect(Effect::kinematic_motion), nothing, plan_motion},
  {Stage::joint_rows,           "0 joint rows",                        added, any(jointed), nothing, begin_joints},
  {Stage::repulsion_pairs,      "0 repulsion pairs",                   added, effect(Effect::self_repulsion), nothing, find_repulsions_at_start},
  // I    v^n -> v~^{n+1/2}
  {Stage::advance_velocity,     "I.1 advance velocity",                other, always, half_step, advance_velocity},
  {Stage::volume_correction,    "I.2 volume correction",               other, any(incompressible), half_step, correct_volume},
  {Stage::self_repulsion,       "I.3 self-repulsion",                  paper, effect(Effect::self_repulsion), half_step, repel_surfaces},
  {Stage::air_drag_halfway,     "I air drag",                          added, effect(Effect::air_drag), half_step, slow_in_air_halfway},
  {Stage::applied_forces_halfway, "I applied forces",                  added, applied, half_step, push_bodies_halfway},
  // II   v^n -> v^^n, v~^{n+1/2} -> v^^{n+1/2}
  {Stage::contact_candidates,   "II contact candidates",               paper, any(meeting), nothing, find_contacts},
  {Stage::back_to_start,        "II back to v^n",                      paper, any(meeting | jointed), exchange, return_to_start},
  {Stage::collisions,           "II.1 collisions",                     other, any(meeting), velocity, collide},
  {Stage::collided_joints,      "II.2 post-stabilization",             other, any(jointed), velocity, stabilize_collided},
  {Stage::re_evolution,         "II.3 re-evolution",                   paper, any(meeting | jointed), exchange, evolve_again},
  // III  v^^{n+1/2} -> v^{n+1/2}
  {Stage::contact_graph,        "III.1 contact graph",                 other, any(touching), nothing, find_contact_graph},
  {Stage::solved_islands,       "III.1 islands of the solve",          added, solved_contact, nothing, leave_contact_to_solve},
  {Stage::warm_start,           "III.1 warm start",                    added, any(touching), half_step, start_contact_warm},
  {Stage::control,              "III.2 PD control",                    other, any(jointed), half_step, control_joints},
  {Stage::contact,              "III.3 contact and pre-stabilization", other, any(touching | jointed), half_step, apply_contact},
  {Stage::contact_in_solve,     "III.3 contact in the solve",          added, solved_contact, half_step, solve_contact_halfway},
  {Stage::volume_in_contact,    "III.3 volume correction",             added, volume_in_contact(both), half_step, correct_volume_in_contact},
  {Stage::turn_of_joints,       "III.3 turn of joints",                added, any(jointed), nothing, nullptr, joints_turn_too_far},
  // IV   x^n -> x^{n+1}, v^^n -> v-^n
  {Stage::advance_position,     "IV.1 advance position",               other, always, position, advance_position},
  {Stage::push_out,             "IV.2 interpenetration resolution",    other, effect(Effect::push_out), position, push_out},
  {Stage::back_to_collided,     "IV.3 back to v^^n",                   paper, always, exchange, return_to_collided},
  {Stage::post_stabilization,   "IV.3 post-stabilization",             other, any(jointed), velocity, finish_positions},
  {Stage::energy_of_joints,     "IV.3 energy of joints",               added, any(jointed), nothing, nullptr, joints_miss_energy},
  {Stage::air_drag,             "IV air drag",                         added, effect(Effect::air_drag), velocity, slow_in_air},
  {Stage::applied_forces,       "IV applied forces",                   added, applied, velocity, push_bodies},
  {Stage::embedded_particles,   "IV embedded particles",               added, any(bones), nothing, follow_bones},
  {Stage::self_collision,       "IV self-collision",                   paper, effect(Effect::self_collision), velocity, collide_surfaces},
  // V    v-^n -> v^{n+1}: the beginning that both orders share
  {Stage::repulsion_pairs_at_end, "V repulsion pairs",                   paper, effect(Effect::self_repulsion), nothing, find_repulsions},
  {Stage::spin_at_start,        "V spin at the start",                 added, spin(both), nothing, begin_spin},
  {Stage::solve_constraints,    "V.2 constraints",                     other, last_solve, nothing, find_solve_constraints},
  {Stage::middle_forces,        "V.2 forces of the middle",            paper, always, nothing, find_middle_forces},
  {Stage::constrained_solve,    "V.2 constrained solve",               other, last_solve, nothing, constrained_solve},
  {Stage::re_evaluation,        "V.3 re-evaluation",                   paper, always, velocity, evaluate_again},
  {Stage::contact_in_solve_at_end, "V.3 contact in the solve",         added, solved_contact, velocity, solve_contact_at_end},
  //      order after_solve: V.1 before V.4
  {Stage::make_incompressible,  "V.1 make incompressible",             other, any(incompressible, after_solve), velocity, make_incompressible},
  {Stage::spin,                 "V spin",                              added, spin(after_solve), position, keep_spin},
  //      V.4 in both orders
  {Stage::contacts_at_end,      "V.4 contacts at the end",             added, any(touching), velocity, prepare_contacts_at_end},
  {Stage::control_at_end,       "V.4 post-stabilization and control",  other, any(jointed), velocity, control_joints_at_end},
  {Stage::contact_at_end,       "V.4 contact and post-stabilization",  other, any(touching), velocity, apply_contact_at_end},
  {Stage::repulsion_at_end,     "V.4 self-repulsion",                  paper, effect(Effect::self_repulsion), velocity, repel_surfaces_at_end},
  {Stage::volume_at_end,        "V.4 keep volume",                     added, volume_in_contact(after_solve), velocity, keep_volume},
  //      order before_solve: damping and V.1 after V.4
  {Stage::damping_at_end,       "V.4 damping",                         paper, any(0, before_solve), velocity, damp_at_end},
  {Stage::make_incompressible,  "V.1 make incompressible",             other, any(incompressible, before_solve), velocity, make_incompressible},
  {Stage::spin,                 "V spin",                              added, spin(before_solve), position, keep_spin},
  // Stages that are timed within the stages above
  {Stage::elastic_forces,       "elastic forces",                      paper, always, nothing, nullptr, nullptr, Timing::within_others},
  {Stage::damping_solve,        "damping solve",                       paper, always, nothing, nullptr, nullptr, Timing::within_others},
  {Stage::shock_propagation,    "shock propagation",                   paper, always, nothing, nullptr, nullptr, Timing::within_others},
  {Stage::joints,               "joints",                              paper, always, nothing, nullptr, nullptr, Timing::within_others},
});
// clang-format on

/// Returns the number of a stage.
constexpr auto as_number(Stage stage) { return static_cast<std::size_t>(stage); }

/// Counts the stages, and fails to compile unless their first rows come in the order of Stage.
///
/// Stages with a row in each order of step V count once.
consteval std::size_t count_stages() {
  std::size_t count = 0;
  for (const StageRow& row : rows) {
    if (as_number(row.stage) == count) ++count;
    if (as_number(row.stage) > count) throw "a stage has no row, or not in the order of Stage";
  }
  return count;
}

}  // namespace stage_page

/// The table of the time step, in the order in which the stages run.
inline constexpr auto& stage_table = stage_page::rows;
/// The number of stages.
inline constexpr std::size_t stage_count = stage_page::count_stages();
static_assert(stage_count == stage_page::as_number(Stage::joints) + 1, "the last stages have no rows");

/// The first row of every stage, indexed by Stage.
inline constexpr std::array<StageRow, stage_count> stage_rows = [] {
  std::array<StageRow, stage_count> first{};
  for (std::size_t i = stage_table.size(); i-- > 0;)
    first[stage_page::as_number(stage_table[i].stage)] = stage_table[i];
  return first;
}();
/// Returns the first row of a stage.
constexpr const StageRow& row_of(Stage stage) { return stage_rows[static_cast<std::size_t>(stage)]; }
/// Returns the name of a stage in statistics.
constexpr std::string_view name(Stage stage) { return row_of(stage).label; }

/// Returns whether step() runs this row in `world`: whether all its needs are met.
bool runs(const StageRow& row, const World& world);

}  // namespace duet
