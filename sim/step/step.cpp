#include "sim/step/step.h"

#include <algorithm>

#include "sim/base/stop.h"

namespace duet {
namespace {

// Restores the state of time n and returns false, the result of a refused step.
bool refuse(World& world) {
  restore_step_start(world);
  return false;
}

// Largest number of times in a row that a step is refused because its contact was not solved for.
constexpr int max_unsolved = 2;

// Returns whether an implicit step is to be refused because its solves with contact have not converged. What
// they leave goes into the strain of elements, which would throw bodies in later steps.
bool leaves_contact_unsolved(const World& world, Refusal& refusal) {
  if (!world.settings.implicit_elasticity || world.context.solved.converged) return false;
  return refusal.unsolved++ < max_unsolved;
}

// Runs a row with work, with clock, ledger and hashes around it.
void run(const StageRow& row, World& world) {
  stop_if_asked();
  world.ledger.begin_stage(world, row.stage);
  world.clock.time(row.stage, [&] { row.work(world, world.context); });
  world.ledger.end_stage(world, row.stage);
  world.contact_tally.end_stage(world, row.stage);
  world.stage_hashes.end_stage(world, row.stage);
}

// Runs the check of a row without work.
bool is_too_long(const StageRow& row, World& world) {
  bool is_too_long = false;
  world.clock.time(row.stage, [&] { is_too_long = row.is_too_long(world, world.context); });
  return is_too_long;
}

}  // namespace

bool runs(const StageRow& row, const World& world) {
  const EffectMask plan = static_cast<EffectMask>(world.plan.to_ulong());
  const auto has = [&](EffectMask effects) { return effects == 0 || (plan & effects) != 0; };
  const ConstraintOrder order =
      world.settings.constraints_before_solve ? ConstraintOrder::before_solve : ConstraintOrder::after_solve;
  const Needs& needs = row.needs;
  return row.timing == Timing::by_step && has(needs.any) && has(needs.and_any) &&
         (needs.order == ConstraintOrder::both || needs.order == order) &&
         (needs.when == nullptr || needs.when(world));
}

// The stages are the rows of sim/step/stage_table.h, in their order.
bool step(World& world, double time, double dt, Refusal* refusal) {
  StepContext& context = world.context;
  context.time = time;
  context.dt = dt;
  begin_step(world, context);
  const bool may_refuse = refusal && refusal->is_allowed;
  const bool may_gain = may_refuse && may_gain_energy(world);
  const StoredEnergy energy = may_gain ? energy_now(world) : StoredEnergy();
  world.ledger.begin_step(world);
  world.contact_tally.begin_step(world.bodies);
  world.stage_hashes.begin_step(world);
  context.contact.parting_work = 0;
  for (const StageRow& row : stage_table) {
    if (!runs(row, world)) continue;
    if (row.work)
      run(row, world);
    else if (may_refuse && is_too_long(row, world))
      return refuse(world);
  }
  end_step(world);
  if (may_gain && gains_energy(world, energy, *refusal)) return refuse(world);
  if (may_refuse && leaves_contact_unsolved(world, *refusal)) return refuse(world);
  world.ledger.end_step(world);
  world.contact_tally.end_step(world.bodies);
  if (world.touches())
    store_contacts(context.contact.contacts, context.contact.graph, dt, world.last_step.contact_cache);
  if (world.has(Effect::self_repulsion))
    std::swap(world.last_step.surface_friction, context.surfaces.friction_next);
  std::swap(world.last_step.pressure, context.pressures.next);
  std::swap(world.last_step.pair_forces, context.solved.pair_forces_next);
  std::swap(world.last_step.joint_drive, context.joints.drive);
  world.stage_hashes.end_step(world);
  return true;
}

void run_stages(World& world, Stage first, Stage last) {
  const auto is = [](Stage stage) { return [stage](const StageRow& row) { return row.stage == stage; }; };
  const auto begin = std::find_if(stage_table.begin(), stage_table.end(), is(first));
  const auto end = std::find_if(stage_table.rbegin(), stage_table.rend(), is(last)).base();
  for (auto row = begin; row < end; ++row)
    if (row->work && runs(*row, world)) run(*row, world);
}

}  // namespace duet
