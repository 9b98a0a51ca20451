#include "sim/step/contact_tally.h"

#include <algorithm>

#include "sim/step/world.h"

namespace duet {

void ContactSums::reset(const Bodies& bodies) {
  particle.reset(bodies.particles.size());
  linear.assign(bodies.rigid.size(), Vec3::Zero());
  angular.assign(bodies.rigid.size(), Vec3::Zero());
}

void ContactSums::add(const ContactSums& other) {
  particle.add(other.particle);
  for (std::size_t i = 0; i < linear.size(); ++i) {
    linear[i] += other.linear[i];
    angular[i] += other.angular[i];
  }
}

void ContactTally::end_step(const Bodies& bodies) {
  if (!knows(bodies)) frame_.reset(bodies);
  has_steps_ = true;
  frame_.add(step_);
}

void ContactTally::end_stage(const World& world, Stage stage) {
  const StepContext& context = world.context;
  if (!step_.fits(world.bodies)) step_.reset(world.bodies);  // tests may run stages without a step
  switch (stage) {
    case Stage::collisions:
      return add_contacts(world.bodies, context.contact.contacts, context.contact.collisions.pairs,
                          Pairs::all);
    case Stage::contacts_at_end:
      return visit_turned(
          context.contact.first_frames, world.bodies, context.contact.contacts,
          [&](int body, const Vec3& impulse, const Vec3& angular) {
            step_.linear[as_index(body)] += impulse;
            step_.angular[as_index(body)] += angular;
          },
          [&](std::size_t particle, const Vec3& impulse, double along_normal) {
            step_.particle.add(particle, impulse, along_normal);
          });
    case Stage::contact_at_end:
      return add_contacts(world.bodies, context.contact.contacts, context.contact.graph.pairs, Pairs::active);
    case Stage::contact_in_solve_at_end:  // V.4 applies the impulses of contacts; those of pairs remain
      if (context.solved.islands.searched() > 0) context.solved.forces.add_pair_impulses(step_.particle);
      return;
    case Stage::self_collision:
      return add_self_collisions(world);
    case Stage::make_incompressible:
    case Stage::volume_at_end:
      return add_answer_to_pressures(world);
    case Stage::damping_at_end:
      return add_answer_to_damping(world);
    default:
      return;
  }
}

void ContactTally::add_contacts(const Bodies& bodies, const ContactSet& contacts,
                                const std::vector<int>& pairs, Pairs which) {
  const auto push = [&](int body, const Vec3& arm, const Vec3& impulse) {
    step_.linear[as_index(body)] += impulse;
    step_.angular[as_index(body)] += arm.cross(impulse);
  };
  for (const int p : pairs) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    if (which == Pairs::active && !pair.active) continue;
    if (pair.guest_rigid >= 0) {
      step_.angular[as_index(pair.guest_rigid)] += pair.angular_impulse;
      step_.angular[as_index(pair.host)] -= pair.angular_impulse;
    }
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& contact = contacts.points[as_index(i)];
      const Vec3& impulse = contact.impulse;
      if (impulse.isZero(0)) continue;
      if (moves_host(bodies, contact) || !bodies.rigid.properties[as_index(contact.host)].is_dynamic())
        push(contact.host, contact.host_arm, -impulse);
      if (contact.is_rigid_pair()) {
        push(contact.guest_rigid, contact.guest_arm, impulse);
        continue;
      }
      const SurfacePoint& point = surface_point(bodies, contact);
      const double along_normal = impulse.dot(contact.normal);
      for (std::size_t k = 0; k < as_index(point.count); ++k)
        step_.particle.add(as_index(point.particle[k]), point.weight[k] * impulse,
                           point.weight[k] * along_normal);
    }
  }
}

void ContactTally::add_self_collisions(const World& world) {
  const Particles& particles = world.bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p) {
    const Vec3 change = particles.x[p] - world.context.states.x_next[p];
    if (is_held(particles, p) || change.isZero(0)) continue;
    step_.particle.add(p, particles.mass[p] / world.context.dt * change);
  }
}

void ContactTally::add_answer_to_pressures(const World& world) {
  const StepContext& context = world.context;
  if (context.solve.projection.empty()) return;
  const Bodies& bodies = world.bodies;
  const PressureScratch& pressure = context.pressures.scratch;
  alone_.particle.assign(bodies.particles.size(), Vec3::Zero());
  alone_.linear.assign(bodies.rigid.size(), Vec3::Zero());
  alone_.angular = alone_.linear;
  pressure_change(bodies, pressure.pressure, held_impulse_, alone_);
  for (std::size_t p = 0; p < alone_.particle.size(); ++p) {
    if (is_held(bodies.particles, p) || pressure.change.particle[p] == alone_.particle[p]) continue;
    step_.particle.add(p, bodies.particles.mass[p] * (pressure.change.particle[p] - alone_.particle[p]));
  }
  if (world.has(Effect::articulation)) return;  // the projection mixes impulses of contacts and joints
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const RigidProperties& properties = bodies.rigid.properties[i];
    if (!properties.is_dynamic()) continue;
    const Mat3 rotation = bodies.rigid.state[i].pose.orientation.toRotationMatrix();
    const Vec3 body_rate = rotation.transpose() * (pressure.change.angular[i] - alone_.angular[i]);
    step_.linear[i] += properties.mass * (pressure.change.linear[i] - alone_.linear[i]);
    step_.angular[i] += rotation * properties.inertia.cwiseProduct(body_rate);
  }
}

void ContactTally::add_answer_to_damping(const World& world) {
  const StepContext& context = world.context;
  if (context.solve.projection.empty() || !world.has_internal_forces()) return;
  const Particles& particles = world.bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p) {
    const Vec3 alone = context.dt * particles.inverse_mass[p] * context.solve.force[p];
    if (is_held(particles, p) || context.solve.correction.particle[p] == alone) continue;
    step_.particle.add(p, particles.mass[p] * (context.solve.correction.particle[p] - alone));
  }
  if (world.has(Effect::articulation) || !world.bodies.bound.empty()) return;
  for (std::size_t i = 0; i < world.bodies.rigid.size(); ++i) {
    const RigidProperties& properties = world.bodies.rigid.properties[i];
    if (!properties.is_dynamic()) continue;
    step_.linear[i] += properties.mass * context.solve.correction.linear[i];
    step_.angular[i] += context.solve.inertia[i] * context.solve.correction.angular[i];
  }
}

}  // namespace duet
