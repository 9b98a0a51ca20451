#include "sim/state/bodies.h"

namespace duet {

Momentum momentum(const Bodies& bodies) {
  Momentum total;
  const Particles& particles = bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p) {
    const Vec3 linear = particles.mass[p] * particles.v[p];
    total.linear += linear;
    total.angular += particles.x[p].cross(linear);
  }
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const RigidState& state = bodies.rigid.state[i];
    const Vec3 linear = bodies.rigid.properties[i].mass * state.velocity;
    total.linear += linear;
    total.angular += state.pose.position.cross(linear) + state.angular_momentum;
  }
  return total;
}

double kinetic_energy(const Bodies& bodies) {
  double energy = 0;
  const Particles& particles = bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p)
    energy += 0.5 * particles.mass[p] * particles.v[p].squaredNorm();
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    energy += kinetic_energy(bodies.rigid.state[i], bodies.rigid.properties[i]);
  return energy;
}

double gravitational_energy(const Bodies& bodies, const Vec3& gravity) {
  double energy = 0;
  const Particles& particles = bodies.particles;
  for (std::size_t p = 0; p < particles.size(); ++p)
    energy -= particles.mass[p] * gravity.dot(particles.x[p]);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    energy -= bodies.rigid.properties[i].mass * gravity.dot(bodies.rigid.state[i].pose.position);
  return energy;
}

}  // namespace duet
