#include "sim/embedding/embedded_particles.h"

#include "sim/base/assert.h"
#include "sim/base/dense_solvers.h"

namespace duet {

EmbeddedParticle embed_particle(std::size_t p, std::size_t body, RigidBodies& rigid, Particles& particles) {
  RigidProperties& properties = rigid.properties[body];
  RigidState& state = rigid.state[body];
  DUET_ASSERT(properties.is_dynamic());
  const Vec3 angular_velocity = state.angular_velocity;
  const double own = particles.mass[p], mass = properties.mass + own;
  properties.inertia *= mass / properties.mass;
  properties.mass = mass;
  properties.inverse_mass = 1 / mass;
  set_angular_velocity(state, properties, angular_velocity);
  particles.mass[p] = particles.inverse_mass[p] = 0;
  return {p, body, p, own, state.pose.to_body(particles.x[p]), particles.x[p] - state.pose.position};
}

void follow_bodies(const RigidBodies& rigid, std::vector<EmbeddedParticle>& bound, Particles& particles) {
  for (EmbeddedParticle& b : bound) {
    const RigidState& state = rigid.state[b.body];
    particles.x[b.particle] = state.pose.to_world(b.arm);
    b.offset = particles.x[b.at] - state.pose.position;
    particles.v[b.particle] = point_velocity(state, b.offset);
  }
}

void follow_twists(const std::vector<EmbeddedParticle>& bound, const std::vector<Vec3>& linear,
                   const std::vector<Vec3>& angular, std::vector<Vec3>& velocity) {
  DUET_ASSERT(linear.size() == angular.size());
  for (const EmbeddedParticle& b : bound)
    velocity[b.particle] = linear[b.body] + angular[b.body].cross(b.offset);
}

void add_force_twists(const RigidBodies& rigid, const std::vector<EmbeddedParticle>& bound,
                      const std::vector<Vec3>& force, double scale, std::vector<Vec3>& linear,
                      std::vector<Vec3>& angular) {
  DUET_ASSERT(linear.size() == rigid.size() && angular.size() == rigid.size());
  for (const EmbeddedParticle& b : bound) {
    linear[b.body] += scale * rigid.properties[b.body].inverse_mass * force[b.particle];
    angular[b.body] += scale * (rigid.state[b.body].inverse_inertia * b.offset.cross(force[b.particle]));
  }
}

double equivalent_mass(const RigidProperties& body, const std::vector<EmbeddedParticle>& bound,
                       std::size_t number) {
  // The result is the largest c with M >= c sum J^T J, where J maps the body's twist to the velocity of a
  // particle. That is the inverse of the largest eigenvalue of M^-1/2 (sum J^T J) M^-1/2; M is diagonal in
  // the body's axes. `root` is the diagonal of M^-1/2.
  Vec6 root;
  root << Vec3::Constant(1 / std::sqrt(body.mass)), body.inertia.cwiseSqrt().cwiseInverse();
  Mat6 unit = Mat6::Zero();
  for (const EmbeddedParticle& b : bound) {
    if (b.body != number) continue;
    Eigen::Matrix<double, 3, 6> jacobian;
    jacobian << Mat3::Identity(), -skew(b.arm);
    unit += jacobian.transpose() * jacobian;
  }
  DUET_ASSERT(unit(0, 0) > 0);  // the body has a bound particle
  return 1 / symmetric_eigen<6>(root.asDiagonal() * unit * root.asDiagonal()).values[5];
}

}  // namespace duet
