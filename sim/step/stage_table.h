// The time step (paper section 2) on one page: the stages in the order in which they run.
//
// step() goes through this table from top to bottom. The names and counts of stages in statistics, the
// ledger, `duet explain` and the hashes of stages are made from it; tests/unit/step/stage_table_test.cpp
// holds sim/step/README.md, which explains every stage, to it.
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
  other = '~',  ///< by another method, or in another order
  added = '+',  ///< the paper has no such stage
};

/// What a stage changes of the bodies, by which the ledger of momentum knows how to count it.
enum class Changes {
  nothing,    ///< none of their positions and velocities, but those of particles that others carry
  half_step,  ///< velocities on their way to v^{n+1/2}, which moves the bodies and is dropped in step IV
  exchange,   ///< velocities, given up for others that the step has kept
  velocity,   ///< velocities on their way to v^{n+1}, by impulses
  position,   ///< positions, and what moving them costs
};

/// The two orders of step V.
enum class ConstraintOrder {
  both,
  after_solve,   ///< V.4 sees all forces (paper section 7)
  before_solve,  ///< V.4 sees the explicit forces, and damping acts after it (section 7.2)
};

using EffectMask = std::uint32_t;
static_assert(effect_count <= 32);

template <class... Effects>
constexpr EffectMask mask(Effects... effects) {
  return (EffectMask{0} | ... | (EffectMask{1} << static_cast<unsigned>(effects)));
}

/// When a stage runs: every condition has to hold.
struct Needs {
  EffectMask any = 0;      ///< effects of which the plan has one; 0: it needs none
  EffectMask and_any = 0;  ///< more effects of which the plan has one; 0: it needs none
  ConstraintOrder order = ConstraintOrder::both;
  bool (*when)(const World&) = nullptr;  ///< what settings and materials ask for; null: nothing
};

/// Who runs a stage.
enum class Timing {
  by_step,        ///< step(), at its place in the table
  within_others,  ///< other stages, whose seconds contain its seconds
  before_step,    ///< the caller of step()
};

/// A line of the page.
struct StageRow {
  Stage stage;
  std::string_view label;  ///< in statistics; begins with the number of the paper
  Origin origin;
  Needs needs;
  Changes changes;
  void (*work)(World&, StepContext&) = nullptr;
  /// Asked where there is no work: whether the step is too long. It is only asked if a shorter one may be
  /// taken.
  bool (*is_too_long)(const World&, const StepContext&) = nullptr;
  Timing timing = Timing::by_step;
};

/// Whether contact may be part of the velocity solve of some bodies (sim/step/solved_bodies.cpp).
bool solves_contact(const World& world);
/// Whether free islands keep their spin (sim/step/keep_spin.cpp).
bool keeps_spin(const World& world);
/// Whether pressures of incompressible bodies act once more after contact. Implicit steps have contact inside
/// their solves.
bool keeps_volume_in_contact(const World& world);
/// Whether damping forces are solved for in step V. Implicit steps take those of their middle, which I.1
/// found.
bool solves_at_end(const World& world);

namespace stage_page {

using enum Origin;
using enum Changes;
using enum ConstraintOrder;

constexpr EffectMask touching = mask(Effect::rigid_contact, Effect::rigid_deformable_contact);
constexpr EffectMask meeting = touching | mask(Effect::rigid_collision);
constexpr EffectMask jointed = mask(Effect::articulation);
constexpr EffectMask elastic = mask(Effect::deformable_elasticity, Effect::springs, Effect::bending);
constexpr EffectMask incompressible = mask(Effect::incompressibility);
constexpr EffectMask bones = mask(Effect::hard_bindings, Effect::soft_bindings);

constexpr Needs always{};
constexpr Needs any(EffectMask effects, ConstraintOrder order = both) { return {effects, 0, order}; }
constexpr Needs effect(Effect needed) { return {mask(needed)}; }
constexpr Needs volume_in_contact(ConstraintOrder order) {
  return {touching, incompressible, order, keeps_volume_in_contact};
}
constexpr Needs last_solve{elastic | incompressible, 0, after_solve, solves_at_end};
constexpr Needs solved_contact{elastic, 0, both, solves_contact};
constexpr Needs spin(ConstraintOrder order) { return {elastic, 0, order, keeps_spin}; }

// clang-format off
inline constexpr auto rows = std::to_array<StageRow>({
  // Before the step, and what it has to know of x^n
  {Stage::time_step_choice,     "time step choice",                    other, always, nothing,   nullptr, nullptr, Timing::before_step},
  {Stage::kinematic_motion,     "0 kinematic motion",                  added, effect(Effect::kinematic_motion), nothing, plan_motion},
  {Stage::joint_rows,           "0 joint rows",                        added, any(jointed), nothing, begin_joints},
  // I    v^n -> v~^{n+1/2}
  {Stage::advance_velocity,     "I.1 advance velocity",                other, always, half_step, advance_velocity},
  {Stage::volume_correction,    "I.2 volume correction",               other, any(incompressible), half_step, correct_volume},
  {Stage::self_repulsion,       "I.3 self-repulsion",                  paper, effect(Effect::self_repulsion), half_step, repel_surfaces},
  {Stage::air_drag_halfway,     "I air drag",                          added, effect(Effect::air_drag), half_step, slow_in_air_halfway},
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
  {Stage::embedded_particles,   "IV embedded particles",               added, any(bones), nothing, follow_bones},
  {Stage::self_collision,       "IV self-collision",                   paper, effect(Effect::self_collision), velocity, collide_surfaces},
  // V    v-^n -> v^{n+1}: what both orders begin with,
  {Stage::repulsion_pairs,      "V repulsion pairs",                   paper, effect(Effect::self_repulsion), nothing, find_repulsions},
  {Stage::spin_at_start,        "V spin at the start",                 added, spin(both), nothing, begin_spin},
  {Stage::solve_constraints,    "V.2 constraints",                     other, last_solve, nothing, find_solve_constraints},
  {Stage::middle_forces,        "V.2 forces of the middle",            paper, always, nothing, find_middle_forces},
  {Stage::constrained_solve,    "V.2 constrained solve",               other, last_solve, nothing, constrained_solve},
  {Stage::re_evaluation,        "V.3 re-evaluation",                   paper, always, velocity, evaluate_again},
  {Stage::contact_in_solve_at_end, "V.3 contact in the solve",         added, solved_contact, velocity, solve_contact_at_end},
  // V.1 before V.4 in the one,
  {Stage::make_incompressible,  "V.1 make incompressible",             other, any(incompressible, after_solve), velocity, make_incompressible},
  {Stage::spin,                 "V spin",                              added, spin(after_solve), position, keep_spin},
  // V.4 in both,
  {Stage::contacts_at_end,      "V.4 contacts at the end",             added, any(touching), velocity, prepare_contacts_at_end},
  {Stage::control_at_end,       "V.4 post-stabilization and control",  other, any(jointed), velocity, control_joints_at_end},
  {Stage::contact_at_end,       "V.4 contact and post-stabilization",  other, any(touching), velocity, apply_contact_at_end},
  {Stage::repulsion_at_end,     "V.4 self-repulsion",                  paper, effect(Effect::self_repulsion), velocity, repel_surfaces_at_end},
  {Stage::volume_at_end,        "V.4 keep volume",                     added, volume_in_contact(after_solve), velocity, keep_volume},
  // damping and V.1 after it in the other.
  {Stage::damping_at_end,       "V.4 damping",                         paper, any(0, before_solve), velocity, damp_at_end},
  {Stage::make_incompressible,  "V.1 make incompressible",             other, any(incompressible, before_solve), velocity, make_incompressible},
  {Stage::spin,                 "V spin",                              added, spin(before_solve), position, keep_spin},
  // Timed within the stages above
  {Stage::elastic_forces,       "elastic forces",                      paper, always, nothing, nullptr, nullptr, Timing::within_others},
  {Stage::damping_solve,        "damping solve",                       paper, always, nothing, nullptr, nullptr, Timing::within_others},
  {Stage::shock_propagation,    "shock propagation",                   paper, always, nothing, nullptr, nullptr, Timing::within_others},
  {Stage::joints,               "joints",                              paper, always, nothing, nullptr, nullptr, Timing::within_others},
});
// clang-format on

constexpr auto as_number(Stage stage) { return static_cast<std::size_t>(stage); }

// The rows come in the order of Stage, but for stages that have a row in each order of step V.
consteval std::size_t count_stages() {
  std::size_t count = 0;
  for (const StageRow& row : rows) {
    if (as_number(row.stage) == count) ++count;
    if (as_number(row.stage) > count) throw "a stage has no row, or not in the order of Stage";
  }
  return count;
}

}  // namespace stage_page

inline constexpr auto& stage_table = stage_page::rows;
inline constexpr std::size_t stage_count = stage_page::count_stages();
static_assert(stage_count == stage_page::as_number(Stage::joints) + 1, "the last stages have no rows");

/// The first row of every stage, by Stage.
inline constexpr std::array<StageRow, stage_count> stage_rows = [] {
  std::array<StageRow, stage_count> first{};
  for (std::size_t i = stage_table.size(); i-- > 0;)
    first[stage_page::as_number(stage_table[i].stage)] = stage_table[i];
  return first;
}();
constexpr const StageRow& row_of(Stage stage) { return stage_rows[static_cast<std::size_t>(stage)]; }
constexpr std::string_view name(Stage stage) { return row_of(stage).label; }

/// Whether step() enters this row.
bool runs(const StageRow& row, const World& world);

}  // namespace duet
