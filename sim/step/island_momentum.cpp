// Momentum that a velocity solve with contact has lost, and gets back here. The solve ends within a
// tolerance, and damping forces at another deformation than that of the positions have a moment. The residual
//
//   r = b + dt M^-1 (F_damping(V) + J) - V
//
// has the momentum that the bodies lack, less the moment of the internal damping forces, which should have
// none.
#include "sim/step/step.h"

namespace duet {
namespace {

// Adds particle `p` at `x` (m) to `whole`, with the residual of its velocity and the moment of its internal
// damping force over `dt` (s).
void add_particle(const World& world, std::size_t p, const Vec3& x, double dt, CompositeBody& whole) {
  const StepContext& context = world.context;
  const Particles& particles = world.bodies.particles;
  const Vec3 drag = -world.bodies.forces.elements.drag(p) * context.solve.solution.particle[p];
  whole.add_moment(x, -dt * (context.solve.damping_force[p] - drag));
  if (!is_held(particles, p)) whole.add(particles.mass[p], x, context.solve.newton_residual.particle[p]);
}

// Returns the impulse (N s) of pins or mass-proportional damping on particle `p` over `dt` (s).
Vec3 impulse_of_holders(const World& world, std::size_t p, double dt) {
  const StepContext& context = world.context;
  const Particles& particles = world.bodies.particles;
  if (!is_held(particles, p))
    return -dt * world.bodies.forces.elements.drag(p) * context.solve.solution.particle[p];
  // Internal forces have no sum, so that the pins give the opposite of the forces on pinned particles to the
  // other particles. Bound particles are held but have no mass; the forces on them act on their bodies.
  return particles.mass[p] > 0 ? Vec3(-dt * context.solve.damping_force[p]) : Vec3::Zero();
}

}  // namespace

void return_momentum_to_islands(World& world, StepContext& context, const Islands& islands, double dt) {
  VelocitySolve& solve = context.solve;
  const Bodies& bodies = world.bodies;
  std::vector<CompositeBody>& wholes = context.solved.wholes;
  wholes.assign(islands.size(), {});
  for (const Islands::Range& range : islands.ranges())
    for (std::size_t p = range.begin; p < range.end; ++p)
      add_particle(world, p, bodies.particles.x[p], dt, wholes[range.island]);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    if (!islands.is_searched_rigid(i)) continue;
    CompositeBody& whole = wholes[as_index(islands.of_rigid(i))];
    whole.add(bodies.rigid.properties[i].mass, bodies.rigid.state[i].pose.position,
              solve.newton_residual.linear[i]);
    whole.add_turning(solve.inertia[i], solve.newton_residual.angular[i]);
  }
  for (std::size_t i = 0; i < wholes.size(); ++i)
    if (islands.has_joints(i))  // joints may hold the island to something fixed
      wholes[i] = {};
    else
      wholes[i].finish();
  for (const Islands::Range& range : islands.ranges())
    for (std::size_t p = range.begin; p < range.end; ++p)
      if (!is_held(bodies.particles, p))
        solve.solution.particle[p] += wholes[range.island].velocity_at(bodies.particles.x[p]);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    if (!islands.is_searched_rigid(i)) continue;
    const CompositeBody& whole = wholes[as_index(islands.of_rigid(i))];
    solve.solution.linear[i] += whole.velocity_at(bodies.rigid.state[i].pose.position);
    solve.solution.angular[i] += whole.turn();
  }
}

void return_momentum_to_bodies(const World& world, const Islands& islands, const std::vector<Vec3>& x,
                               double dt, GeneralizedVelocity& velocity) {
  const Bodies& bodies = world.bodies;
  if (islands.has_joints()) return;
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    if (!islands.is_searched_rigid(i)) continue;
    velocity.linear[i] += world.context.solve.newton_residual.linear[i];
    velocity.angular[i] += world.context.solve.newton_residual.angular[i];
  }
  for (const DeformableBody& body : bodies.deformable) {
    if (!islands.is_searched(as_index(islands.of_particle(body.first_particle)))) continue;
    CompositeBody whole;
    for_each_particle(body, [&](std::size_t p) { add_particle(world, p, x[p], dt, whole); });
    whole.finish();
    for_each_particle(body, [&](std::size_t p) {
      if (!is_held(bodies.particles, p)) velocity.particle[p] += whole.velocity_at(x[p]);
    });
  }
}

Momentum impulse_of_holders(const World& world, const Islands& islands, double dt) {
  const StepContext& context = world.context;
  const Particles& particles = world.bodies.particles;
  Momentum total;
  for (const Islands::Range& range : islands.ranges())
    for (std::size_t p = range.begin; p < range.end; ++p) {
      Vec3 impulse = impulse_of_holders(world, p, dt);
      if (!is_held(particles, p)) impulse -= particles.mass[p] * context.solve.solved_change.particle[p];
      total += {impulse, particles.x[p].cross(impulse)};
    }
  return total;
}

}  // namespace duet
