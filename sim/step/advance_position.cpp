// Step IV.1 and IV.2: positions (paper sections 4.1 and 6).
#include <algorithm>

#include "sim/step/step.h"

namespace duet {

void advance_position(World& world, StepContext& context) {
  Particles& particles = world.bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p) particles.x[p] += context.dt * particles.v[p];
  RigidBodies& rigid = world.bodies.rigid;
  if (world.has(Effect::articulation) && world.settings.orientation == OrientationUpdate::exact)
    context.joints.free_motion.begin(context.joints.solver, rigid, world.gravity, context.dt);
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    if (!rigid.properties[i].is_dynamic()) continue;
    rigid.state[i].pose = evolved_pose(rigid.state[i], context.dt, world.settings.orientation);
    context.states.rigid_n[i].delay = rigid.state[i].delay;  // for the ledger
    rigid.state[i].delay.setZero();
    update_orientation_dependents(rigid.state[i], rigid.properties[i]);
  }
  for (const KinematicStep& step : context.kinematic) rigid.state[step.body].pose = step.end.pose;
  place_carried(context.kinematic, world.bodies);
}

void push_out(World& world, StepContext& context) {
  ContactStage& contact = context.contact;
  const PushOutSettings& settings = world.settings.push_out;
  const bool is_measured = may_gain_energy(world) && !settings.overlapping.empty();
  const double before = is_measured ? potential_energy(world) : 0;  // J
  if (!settings.rigid_pairs && world.has(Effect::rigid_contact))
    separate_rigid_bodies(world.bodies, context.joints.response.prepared(), contact.graph,
                          settings.iterations, contact.contacts, contact.separation);
  if (settings.rigid_pairs || world.has(Effect::rigid_deformable_contact))
    resolve_interpenetration(world.bodies, contact.graph, settings, contact.contacts, contact.push_out);
  check_finite(world, Stage::push_out);
  const std::vector<double>& kept = contact.push_out.kept;
  const bool parts = std::any_of(kept.begin(), kept.end(), [](double overlap) { return overlap > 0; });
  contact.parting_work = is_measured && parts ? potential_energy(world) - before : 0;
}

// Rotation is restored as angular momentum, so that angular velocities follow from the orientations at
// x^{n+1}.
void return_to_collided(World& world, StepContext& context) {
  restore_velocities(context.states.v_hat_n, world.bodies);
}

}  // namespace duet
