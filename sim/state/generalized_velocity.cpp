#include "sim/state/generalized_velocity.h"

#include "sim/state/bodies.h"

namespace duet {

void to_generalized(const Bodies& bodies, GeneralizedVelocity& out) {
  out.particle = bodies.particles.v;
  out.linear.resize(bodies.rigid.size());
  out.angular.resize(bodies.rigid.size());
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    out.linear[i] = bodies.rigid.state[i].velocity;
    out.angular[i] = bodies.rigid.state[i].angular_velocity;
  }
}

}  // namespace duet
