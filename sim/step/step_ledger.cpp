#include "sim/step/step_ledger.h"

#include "sim/step/world.h"

namespace duet {
namespace {

// Returns whether the forces of a stage act at x^{n+1/2}.
bool acts_in_the_middle(Stage stage) {
  return stage == Stage::re_evaluation || stage == Stage::contact_in_solve_at_end ||
         stage == Stage::make_incompressible;
}

// Returns whether a stage continues from impulses that contacts hold from earlier stages.
bool goes_on(Stage stage) {
  return stage == Stage::contact || stage == Stage::contact_in_solve || stage == Stage::contact_at_end;
}

// Returns the change of moments about the origin (kg m^2/s) if rigid bodies are taken at x^{n+1/2} instead of
// x^{n+1}, because forces on the particles bound to them act there. linear(i) returns the momentum or impulse
// of body i (kg m/s).
template <class Linear>
Vec3 moment_in_the_middle(const World& world, Linear&& linear) {
  Vec3 moment = Vec3::Zero();
  const RigidBodies& rigid = world.bodies.rigid;
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    if (!rigid.properties[i].is_dynamic()) continue;
    const RigidState& start = world.context.states.rigid_n[i];
    const Vec3 back = (start.pose.position + start.delay - rigid.state[i].pose.position) / 2;
    moment += back.cross(linear(i));
  }
  return moment;
}

// Returns the impulse that bodies of infinite mass have given through joints.
Momentum impulse_of_joints(const JointSolver& joints) {
  return {joints.from_outside().linear, joints.from_outside().angular};
}

// Returns the impulse that contact adds to pressures under a projection: the impulses on all bodies less
// those of the pressures alone.
Momentum impulse_of_contact(const Bodies& bodies, const PressureScratch& pressure,
                            const std::vector<Vec3>& x) {
  std::vector<Vec3> held;
  GeneralizedVelocity alone{std::vector<Vec3>(x.size(), Vec3::Zero()),
                            std::vector<Vec3>(bodies.rigid.size(), Vec3::Zero()),
                            std::vector<Vec3>(bodies.rigid.size(), Vec3::Zero())};
  pressure_change(bodies, pressure.pressure, held, alone);
  Momentum total;
  for (std::size_t p = 0; p < x.size(); ++p) {
    if (bodies.particles.inverse_mass[p] == 0) continue;
    const Vec3 impulse = bodies.particles.mass[p] * (pressure.change.particle[p] - alone.particle[p]);
    total += {impulse, x[p].cross(impulse)};
  }
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const RigidProperties& properties = bodies.rigid.properties[i];
    const Pose& pose = bodies.rigid.state[i].pose;
    const Vec3 impulse = properties.mass * (pressure.change.linear[i] - alone.linear[i]);
    const Vec3 body_rate = pose.orientation.conjugate() * (pressure.change.angular[i] - alone.angular[i]);
    total += {impulse,
              pose.position.cross(impulse) + pose.orientation * properties.inertia.cwiseProduct(body_rate)};
  }
  return total;
}

}  // namespace

void StepLedger::reset() {
  totals_ = {};
  in_step_ = false;
}

StepLedger::Balance StepLedger::measure(const World& world, const std::vector<Vec3>& x) const {
  Balance balance;
  balance.momentum = momentum(world.bodies, x);
  balance.kinetic = kinetic_energy(world.bodies);
  balance.stored = gravitational_energy(world.bodies, world.gravity);
  if (world.has_internal_forces()) balance.stored += world.bodies.forces.energy(world.bodies.particles.x);
  return balance;
}

StepLedger::Balance StepLedger::measure(const World& world, Stage stage) {
  Balance balance = measure(world, acting_at(world, stage));
  if (acts_in_the_middle(stage) && stage != Stage::make_incompressible)
    balance.momentum.angular += moment_in_the_middle(world, [&](std::size_t i) {
      return Vec3(world.bodies.rigid.properties[i].mass * world.bodies.rigid.state[i].velocity);
    });
  if (stage == Stage::collisions) {  // the delays count as a part of the places, where the impulses act
    const RigidBodies& rigid = world.bodies.rigid;
    for (std::size_t i = 0; i < rigid.size(); ++i)
      balance.momentum.angular +=
          rigid.state[i].delay.cross(rigid.properties[i].mass * rigid.state[i].velocity);
  }
  return balance;
}

const std::vector<Vec3>& StepLedger::acting_at(const World& world, Stage stage) {
  const std::vector<Vec3>& x = world.bodies.particles.x;
  if (!acts_in_the_middle(stage)) return x;
  middle_.resize(x.size());
  for (std::size_t p = 0; p < x.size(); ++p) middle_[p] = 0.5 * (world.context.states.x_n[p] + x[p]);
  return middle_;
}

// Internal forces have no sum, so that pins give the opposite of those on pinned particles to the others.
// context.solve.force holds the internal forces, and the weight of all particles by `gravity` (m/s^2).
Momentum StepLedger::impulse_of_pins(const World& world, const std::vector<Vec3>& x, const Vec3& gravity,
                                     double dt) const {
  Momentum total;
  if (!world.has_internal_forces()) return total;
  const Particles& particles = world.bodies.particles;
  for (std::size_t p = 0; p < x.size(); ++p) {
    if (particles.inverse_mass[p] > 0 || particles.mass[p] == 0) continue;  // bound particles have no mass
    const Vec3 impulse = -dt * (world.context.solve.force[p] - particles.mass[p] * gravity);
    total += {impulse, x[p].cross(impulse)};
  }
  return total;
}

// Mass-proportional damping acts at the velocity context.solve.solution.
Momentum StepLedger::impulse_of_drag(const World& world, const std::vector<Vec3>& x, double dt) const {
  Momentum total;
  if (!world.has_internal_forces()) return total;
  const Particles& particles = world.bodies.particles;
  for (std::size_t p = 0; p < x.size(); ++p) {
    if (particles.inverse_mass[p] == 0 && particles.mass[p] > 0) continue;  // counted with the pins
    const Vec3 impulse =
        -dt * world.bodies.forces.elements.drag(p) * world.context.solve.solution.particle[p];
    total += {impulse, x[p].cross(impulse)};
  }
  return total;
}

Momentum StepLedger::given_by_contact(const World& world, Stage stage) {
  const StepContext& context = world.context;
  active_.clear();  // inactive pairs are solved for later: the impulses that they hold have not been applied
  for (const int p : context.contact.graph.pairs)
    if (context.contact.contacts.pairs[as_index(p)].active) active_.push_back(p);
  Momentum total;
  if (stage != Stage::warm_start && stage != Stage::contacts_at_end && stage != Stage::contact_in_solve)
    total = impulse_of_joints(context.joints.solver);
  return total += contact_impulse(world.bodies, context.contact.contacts, active_);
}

Momentum StepLedger::external(const World& world, Stage stage, const std::vector<Vec3>& x,
                              const Momentum& gain) {
  const StepContext& context = world.context;
  const Bodies& bodies = world.bodies;
  const double dt = context.dt;
  Momentum total;
  switch (stage) {
    case Stage::advance_velocity:
      total = gravity_impulse(bodies, x, world.gravity, dt / 2);
      total += impulse_of_pins(world, x, world.gravity, dt / 2);
      return total += impulse_of_drag(world, x, dt / 2);
    case Stage::re_evaluation:
      holders_of_middle_ = impulse_of_pins(world, x, world.gravity, dt);
      if (!world.settings.constraints_before_solve) holders_of_middle_ += impulse_of_drag(world, x, dt);
      total = gravity_impulse(bodies, x, world.gravity, dt);
      total.angular += moment_in_the_middle(
          world, [&](std::size_t i) { return Vec3(dt * bodies.rigid.properties[i].mass * world.gravity); });
      return total += holders_of_middle_;
    case Stage::contact_in_solve_at_end:  // its forces replace those of V.3
      total = impulse_of_pins(world, x, world.gravity, dt) - holders_of_middle_;
      total += impulse_of_drag(world, x, dt);
      return total += context.solved.from_outside;
    case Stage::damping_at_end:
      // If bodies of infinite mass are in contact, all of the gain is taken to be theirs.
      if (!world.has_internal_forces() || context.solve.projection.is_held()) return gain;
      total = impulse_of_pins(world, x, Vec3::Zero(), dt);
      return total += impulse_of_drag(world, x, dt);
    case Stage::volume_correction:
    case Stage::volume_in_contact:
    case Stage::make_incompressible:
    case Stage::volume_at_end:
      return context.solve.projection.empty() ? total
                                              : impulse_of_contact(bodies, context.pressures.scratch, x);
    case Stage::post_stabilization:
      return context.joints.from_outside;
    case Stage::air_drag_halfway:
    case Stage::air_drag:
    case Stage::applied_forces_halfway:
    case Stage::applied_forces:
      return gain;
    case Stage::collisions:
      total = contact_impulse(bodies, context.contact.contacts, context.contact.collisions.pairs);
      total.angular += context.contact.collisions.delayed_moment;
      return total;
    case Stage::collided_joints:
    case Stage::control:
    case Stage::control_at_end:
      return impulse_of_joints(context.joints.solver);
    case Stage::warm_start:
      return given_by_contact(world, stage);
    case Stage::contacts_at_end:
      total = moved_by_turning(context.contact.first_frames, bodies, context.contact.contacts);
      return total += given_by_contact(world, stage);
    case Stage::contact:
    case Stage::contact_at_end:
      return given_by_contact(world, stage) - given_at_start_;
    case Stage::contact_in_solve:
      total = given_by_contact(world, stage) - given_at_start_;
      return total += context.solved.from_outside;
    default:
      return total;
  }
}

void StepLedger::close(LedgerEntry& entry, const Balance& before, const Balance& after,
                       const Momentum& external) {
  entry.add(after.momentum - before.momentum, external);
  entry.kinetic += after.kinetic - before.kinetic;
  entry.stored += after.stored - before.stored;
}

void StepLedger::begin_step(const World& world) {
  if (!on_) return;
  if (in_step_) totals_ = before_step_;  // the last step failed
  before_step_ = totals_;
  in_step_ = true;
  step_start_ = measure(world, world.bodies.particles.x);
  kept_ = kept_external_ = {};
}

void StepLedger::begin_stage(const World& world, Stage stage) {
  if (!on_ || !counts(stage)) return;
  stage_start_ = measure(world, stage);
  if (goes_on(stage)) given_at_start_ = given_by_contact(world, stage);
  if (stage != Stage::push_out) return;
  before_push_out_ = world.bodies.particles.x;
  rigid_before_push_out_ = world.bodies.rigid.state;
}

void StepLedger::end_stage(const World& world, Stage stage) {
  if (!on_ || !counts(stage)) return;
  if (stage == Stage::push_out)
    totals_.push_out.add(displacement(world.bodies, before_push_out_, rigid_before_push_out_));
  const std::vector<Vec3>& x = acting_at(world, stage);
  const Balance now = measure(world, stage);
  LedgerEntry& entry = totals_.stage[static_cast<std::size_t>(stage)];
  const Changes changes = row_of(stage).changes;
  if (changes == Changes::position) {
    entry.kinetic += now.kinetic - stage_start_.kinetic;
    entry.stored += now.stored - stage_start_.stored;
    return;
  }
  const Momentum from_outside = external(world, stage, x, now.momentum - stage_start_.momentum);
  close(entry, stage_start_, now, from_outside);
  if (changes != Changes::velocity) return;
  kept_ += now.momentum - stage_start_.momentum;
  kept_external_ += from_outside;
}

void StepLedger::end_step(const World& world) {
  if (!on_) return;
  in_step_ = false;
  const Balance now = measure(world, world.bodies.particles.x);
  close(totals_.step, step_start_, now, kept_external_);
  totals_.stage[static_cast<std::size_t>(Stage::advance_position)].add(
      now.momentum - step_start_.momentum - kept_, {});
}

}  // namespace duet
