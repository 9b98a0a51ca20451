#include "sim/step/step.h"

#include "sim/base/stop.h"

namespace duet {
namespace {

bool refuse(World& world) {
  restore_step_start(world);
  return false;
}

}  // namespace

// The paper's section 2. Between its lines the bodies' velocities are those named on the right.
bool step(World& world, double time, double dt, Refusal* refusal) {
  StepContext& context = world.context;
  context.time = time;
  context.dt = dt;
  const bool joints = world.has(Effect::articulation);
  const bool contact = world.touches(), collision = world.meets();
  // Implicit steps have contact inside their solves.
  const bool keeps_volume_in_contact =
      contact && world.has(Effect::incompressibility) && !world.settings.implicit_elasticity;
  const bool spin = world.settings.keep_spin && world.has_internal_forces();
  const auto run = [&](Stage stage, void (*work)(World&, StepContext&)) {
    stop_if_asked();
    world.ledger.begin_stage(world, stage);
    world.clock.time(stage, [&] { work(world, context); });
    world.ledger.end_stage(world, stage);
    world.stage_hashes.end_stage(world, stage);
  };

  begin_step(world, context);
  const bool is_refusable = refusal && refusal->is_allowed;
  const bool may_gain = is_refusable && may_gain_energy(world);
  const StoredEnergy energy = may_gain ? energy_now(world) : StoredEnergy();
  world.ledger.begin_step(world);
  world.stage_hashes.begin_step(world);
  if (world.has(Effect::kinematic_motion)) run(Stage::kinematic_motion, plan_motion);
  if (joints) run(Stage::joints, begin_joints);
  // I    v^n -> v~^{n+1/2}
  run(Stage::advance_velocity, advance_velocity);
  if (world.has(Effect::incompressibility)) run(Stage::volume_correction, correct_volume);
  if (world.has(Effect::self_repulsion)) run(Stage::self_repulsion, repel_surfaces);
  if (world.has(Effect::air_drag)) run(Stage::air_drag_halfway, slow_in_air_halfway);
  if (collision) run(Stage::broad_phase, find_contacts);
  // II   v^n -> v^^n, v~^{n+1/2} -> v^^{n+1/2}
  if (collision || joints) run(Stage::collide, collide);
  // III  v^^{n+1/2} -> v^{n+1/2}
  if (contact || joints || solves_contact(world)) run(Stage::apply_contact, apply_contact);
  if (keeps_volume_in_contact) run(Stage::volume_correction, correct_volume_in_contact);
  const bool may_refuse = joints && is_refusable;
  if (may_refuse && joints_turn_too_far(world, context)) return refuse(world);
  // IV   x^n -> x^{n+1}
  run(Stage::advance_position, advance_position);
  if (world.has(Effect::push_out)) run(Stage::push_out, push_out);
  restore_collided_velocity(world, context);
  if (joints) run(Stage::joints, finish_positions);
  if (may_refuse && joints_miss_energy(world, context)) return refuse(world);
  if (world.has(Effect::air_drag)) run(Stage::air_drag, slow_in_air);
  follow_bodies(world.bodies.rigid, world.bodies.bound, world.bodies.particles);
  if (world.has(Effect::self_collision)) run(Stage::self_collision, collide_surfaces);
  // V    v^^n -> v^{n+1}
  if (world.has(Effect::self_repulsion)) run(Stage::velocity_repulsion, find_repulsions);
  if (spin) begin_spin(world, context);
  const auto constrain = [&] {
    if (contact || joints) run(Stage::velocity_contact, apply_velocity_contact);
    if (world.has(Effect::self_repulsion)) run(Stage::velocity_repulsion, apply_velocity_repulsions);
  };
  const auto count_middle = [&](double sign) {
    if (spin) count_middle_forces(world, context, sign);
  };
  if (world.settings.constraints_first) {
    run(Stage::explicit_forces, apply_explicit_forces);
    count_middle(1);
    constrain();
    run(Stage::constrained_solve, solve_damping);
    if (world.has(Effect::incompressibility)) {
      count_middle(-1);
      run(Stage::make_incompressible, make_incompressible);
      count_middle(1);
    }
    if (spin) keep_spin(world, context);
  } else {
    run(Stage::constrained_solve, constrained_solve);
    if (world.has(Effect::incompressibility)) run(Stage::make_incompressible, make_incompressible);
    count_middle(1);
    if (spin) keep_spin(world, context);
    constrain();
    if (keeps_volume_in_contact) run(Stage::keep_volume, keep_volume);
  }
  end_step(world);
  if (may_gain && gains_energy(world, energy, *refusal)) return refuse(world);
  world.ledger.end_step(world);
  if (contact) remember(context.contacts, context.graph, dt, context.memory);
  std::swap(context.held_pressure, context.new_pressure);
  world.stage_hashes.end_step(world);
  return true;
}

}  // namespace duet
