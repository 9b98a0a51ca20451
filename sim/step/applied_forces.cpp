// The stages that apply forces from outside. Each adds f dt/m to velocities: of half a step to v~^{n+1/2},
// with which bodies move, and of the whole step to v-^n, before step V evaluates elasticity, contact and
// joints. A body that is pushed against a wall does not bounce off it, because v^n, with which bodies
// collide, has no part of the force.
#include "sim/step/applied_forces.h"

#include <algorithm>

#include "sim/contact/detection/contact_point.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Makes room for forces on all bodies, all zero, unless a force acts already.
void begin(const Bodies& bodies, AppliedForces& applied) {
  if (applied.any) return;
  applied.any = true;
  applied.particle.assign(bodies.particles.size(), Vec3::Zero());
  applied.linear.assign(bodies.rigid.size(), Vec3::Zero());
  applied.angular.assign(bodies.rigid.size(), Vec3::Zero());
}

// Adds the impulses of the forces over `dt` (s) to the velocities.
void give(World& world, double dt) {
  Bodies& bodies = world.bodies;
  const AppliedForces& applied = world.applied;
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    apply_impulse(bodies.rigid.state[i], bodies.rigid.properties[i], Vec3::Zero(), dt * applied.linear[i]);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    apply_angular_impulse(bodies.rigid.state[i], bodies.rigid.properties[i], dt * applied.angular[i]);
  Particles& particles = bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p)
    particles.v[p] += dt * particles.inverse_mass[p] * applied.particle[p];
  if (bodies.bound.empty()) return;
  apply_bound_forces(bodies, applied.particle, dt);
  follow_bodies(bodies.rigid, bodies.bound, particles);
}

// Returns a bound on the distance (m) of the farthest corner of the bounding box from the center of mass: it
// is exact if shape space is body space.
double reach(const RigidProperties& properties) {
  const double to_corner =
      properties.shape.lower().cwiseAbs().cwiseMax(properties.shape.upper().cwiseAbs()).norm();
  return properties.shape_frame ? to_corner + properties.shape_frame->position.norm() : to_corner;
}

}  // namespace

void AppliedForces::clear() {
  any = false;
  acceleration = 0;
}

void add_to_rigid(const Bodies& bodies, std::size_t body, const Vec3& force, const Vec3& moment,
                  AppliedForces& applied) {
  begin(bodies, applied);
  applied.linear[body] += force;
  applied.angular[body] += moment;
  const RigidProperties& properties = bodies.rigid.properties[body];
  const Vec3 turning = bodies.rigid.state[body].inverse_inertia * applied.angular[body];  // rad/s^2
  applied.acceleration =
      std::max(applied.acceleration, properties.inverse_mass * applied.linear[body].norm() +
                                         (turning.isZero(0) ? 0 : turning.norm() * reach(properties)));
}

void add_to_deformable(const Bodies& bodies, std::size_t body, const Vec3& force, AppliedForces& applied) {
  double mass = 0;
  for_each_particle(bodies.deformable[body], [&](std::size_t p) {
    if (!is_held(bodies.particles, p)) mass += bodies.particles.mass[p];
  });
  if (mass == 0) return;
  for_each_particle(bodies.deformable[body], [&](std::size_t p) {
    if (!is_held(bodies.particles, p))
      add_to_particle(bodies, p, bodies.particles.mass[p] / mass * force, applied);
  });
}

void add_to_particle(const Bodies& bodies, std::size_t p, const Vec3& force, AppliedForces& applied) {
  begin(bodies, applied);
  applied.particle[p] += force;
  double mobility = bodies.particles.inverse_mass[p];  // 1/kg
  for (const EmbeddedParticle& bound : bodies.bound)
    if (bound.particle == p)
      mobility = 1 / equivalent_mass(bodies.rigid.properties[bound.body], bodies.bound, bound.body);
  applied.acceleration = std::max(applied.acceleration, mobility * applied.particle[p].norm());
}

bool has_applied_forces(const World& world) { return world.applied.any; }

void push_bodies_halfway(World& world, StepContext& context) {
  give(world, context.dt / 2);
  check_finite(world, Stage::applied_forces_halfway);
}

void push_bodies(World& world, StepContext& context) { give(world, context.dt); }

}  // namespace duet
