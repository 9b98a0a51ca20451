#include "sim/state/generalized_velocity.h"

#include "sim/base/assert.h"
#include "sim/state/bodies.h"

namespace duet {
namespace {

// Returns whether there is a velocity of every particle and every rigid body.
[[maybe_unused]] bool has_size_of(const VelocityState& velocities, const Bodies& bodies) {
  return velocities.particle.size() == bodies.particles.size() &&
         velocities.rigid.size() == bodies.rigid.size() && velocities.rotation.size() == bodies.rigid.size();
}

}  // namespace

void to_generalized(const Bodies& bodies, GeneralizedVelocity& out) {
  out.particle = bodies.particles.v;
  out.linear.resize(bodies.rigid.size());
  out.angular.resize(bodies.rigid.size());
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    out.linear[i] = bodies.rigid.state[i].velocity;
    out.angular[i] = bodies.rigid.state[i].angular_velocity;
  }
}

void store_velocities(const Bodies& bodies, VelocityState& out) {
  out.particle = bodies.particles.v;
  out.rigid.resize(bodies.rigid.size());
  out.rotation.resize(bodies.rigid.size());
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    out.rigid[i] = bodies.rigid.state[i].velocity;
    out.rotation[i] = rotation_variable(bodies.rigid.state[i], bodies.rigid.properties[i]);
  }
}

void restore_velocities(const VelocityState& velocities, Bodies& bodies) {
  DUET_ASSERT(has_size_of(velocities, bodies));
  bodies.particles.v = velocities.particle;
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    RigidState& state = bodies.rigid.state[i];
    state.velocity = velocities.rigid[i];
    rotation_variable(state, bodies.rigid.properties[i]) = velocities.rotation[i];
    update_orientation_dependents(state, bodies.rigid.properties[i]);
  }
}

void add_velocities(const VelocityState& change, Bodies& bodies) {
  DUET_ASSERT(has_size_of(change, bodies));
  for (std::size_t p = 0; p < bodies.particles.size(); ++p) bodies.particles.v[p] += change.particle[p];
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    RigidState& state = bodies.rigid.state[i];
    state.velocity += change.rigid[i];
    rotation_variable(state, bodies.rigid.properties[i]) += change.rotation[i];
    update_orientation_dependents(state, bodies.rigid.properties[i]);
  }
}

void velocity_difference(const Bodies& bodies, const VelocityState& base, VelocityState& out) {
  DUET_ASSERT(has_size_of(base, bodies));
  store_velocities(bodies, out);
  for (std::size_t p = 0; p < out.particle.size(); ++p) out.particle[p] -= base.particle[p];
  for (std::size_t i = 0; i < out.rigid.size(); ++i) {
    out.rigid[i] -= base.rigid[i];
    out.rotation[i] -= base.rotation[i];
  }
}

}  // namespace duet
