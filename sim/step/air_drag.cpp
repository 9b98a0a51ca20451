// Air drag, v' = g - k |v| v with k = |g| / v_terminal^2: it grows with the square of the speed.
//
// The midpoint rule takes it through the step. It is of second order in the step and stable for any step,
// because drag only ever slows.
#include "sim/step/step.h"

namespace duet {
namespace {

// Calls slow(velocity, k) for all rigid bodies and particles with air drag k (1/m). The spin of rigid bodies
// is not slowed. Particles are slowed one by one, so that cloth billows.
template <class Slow>
void for_each_slowed(Bodies& bodies, Slow&& slow) {
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].air_drag > 0)
      slow(bodies.rigid.state[i].velocity, bodies.rigid.properties[i].air_drag);
  for (const DeformableBody& body : bodies.deformable) {
    if (body.air_drag == 0) continue;
    const auto first = static_cast<std::size_t>(body.first_particle);
    const auto end = first + static_cast<std::size_t>(body.particle_count);
    for (std::size_t p = first; p < end; ++p)
      if (bodies.particles.inverse_mass[p] > 0) slow(bodies.particles.v[p], body.air_drag);
  }
}

// Returns the velocity that v' = -k |v_now| v leaves of `v` (m/s) after `dt` (s), by backward Euler.
Vec3 slowed(const Vec3& v, double k, double dt) { return v / (1 + k * v.norm() * dt); }

}  // namespace

void slow_in_air_halfway(World& world, StepContext& context) {
  for_each_slowed(world.bodies, [&](Vec3& v, double k) { v = slowed(v, k, context.dt / 2); });
}

// v <- ((1 - h) v - h dt g) / (1 + h) with h = k |v_m| dt/2, where v_m is the slowed velocity of the middle
// of the step. With the gravity that V.3 adds, v_1 - v_0 = dt (g - k |v_m| (v_0 + v_1) / 2).
void slow_in_air(World& world, StepContext& context) {
  const Vec3 falling = context.dt * world.gravity;
  for_each_slowed(world.bodies, [&](Vec3& v, double k) {
    const Vec3 middle = slowed(v + falling / 2, k, context.dt / 2);
    const double h = k * middle.norm() * context.dt / 2;
    v = ((1 - h) * v - h * falling) / (1 + h);
  });
}

}  // namespace duet
