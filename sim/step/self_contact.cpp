// Self-repulsions (paper steps I.3 and V.4) and self-collisions (step IV), between deformable surfaces of one
// body and of several.
#include <algorithm>

#include "sim/base/error.h"
#include "sim/contact/detection/surface_intersections.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Throws the error for particles that cannot be kept from crossing, because held ones are led through a
// surface.
[[noreturn]] void fail(const World& world, const std::array<int, 4>& particle) {
  SimulationFault fault;
  fault.stage = name(Stage::self_collision);
  fault.body = body_name(world.bodies, particle[0]);
  fault.element = "particle " + std::to_string(particle[0]);
  fault.position = world.context.states.x_n[static_cast<std::size_t>(particle[0])];
  fault.cause = "particles that are held fast are led through the surface of `" +
                body_name(world.bodies, particle[3]) + "`";
  fault.remedy = "hold or move other particles, or let the bodies pass with --without self_collision";
  throw SimulationError(fault);
}

// Finds the pairs of surfaces that the predicted positions x^n + dt v bring together.
void find_approaching_surfaces(const World& world, StepContext& context) {
  const Bodies& bodies = world.bodies;
  const Particles& particles = bodies.particles;
  context.states.x_next.resize(particles.size());
  for (std::size_t p = 0; p < particles.size(); ++p)
    context.states.x_next[p] = particles.x[p] + context.dt * particles.v[p];
  context.surfaces.candidates.update(bodies.collision_surface, particles.x, context.states.x_next);
  context.surfaces.approaching.find_approaching(context.surfaces.candidates, particles.x, particles.v,
                                                context.dt, bodies.faces_around, bodies.triangles);
}

// Applies the impulses of step I.3 or V.4, which act for `duration` (s), and stores the mean forces of their
// friction (N). What particles get that rigid bodies carry, these bodies get. Adds the impulses to `tally`
// unless it is null.
void repel(World& world, StepContext& context, double duration, std::vector<Vec3>& friction,
           ContactImpulses* tally) {
  Bodies& bodies = world.bodies;
  Particles& particles = bodies.particles;
  ContactImpulses* impulses = tally;
  if (!bodies.bound.empty()) {
    impulses = &context.surfaces.impulses;
    impulses->reset(particles.size());
  }
  context.surfaces.repulsion.apply(context.dt, particles.x, particles.inverse_mass, particles.v, friction,
                                   impulses);
  for (Vec3& force : friction) force /= duration;
  if (bodies.bound.empty()) return;
  apply_bound_forces(bodies, impulses->total, 1);
  follow_bodies(bodies.rigid, bodies.bound, particles);
  if (tally) tally->add(*impulses);
}

}  // namespace

// I.3, with the pairs of x^n. Those that were constraints of I.1 are treated as the others.
void repel_surfaces(World& world, StepContext& context) {
  Particles& particles = world.bodies.particles;
  const bool solves = solves_contact(world);
  if (solves) {
    find_approaching_surfaces(world, context);
    for (std::size_t p = 0; p < particles.size(); ++p)
      context.solve.solved_change.particle[p] -= particles.v[p];
  }
  context.surfaces.repulsion.deactivate_all_rows();
  repel(world, context, context.dt / 2, context.surfaces.friction, nullptr);
  context.surfaces.repulsion.apply_elastic(context.dt, particles.inverse_mass, particles.v);
  if (solves)  // solves with contact inside leave these impulses out
    for (std::size_t p = 0; p < particles.size(); ++p)
      context.solve.solved_change.particle[p] += particles.v[p];
}

void find_repulsions(World& world, StepContext& context) {
  const Particles& particles = world.bodies.particles;
  context.surfaces.candidates.update(world.bodies.collision_surface, particles.x, particles.x);
  context.surfaces.repulsion.find(context.surfaces.candidates, particles.x, particles.inverse_mass,
                                  world.bodies.faces_around, world.bodies.triangles);
}

void repel_surfaces_at_end(World& world, StepContext& context) {
  repel(world, context, context.dt, context.surfaces.friction_next, &world.contact_tally.on_particles());
  const std::vector<RepulsionPair>& pairs = context.surfaces.repulsion.pairs();
  world.counters.self_repulsions = std::count_if(
      pairs.begin(), pairs.end(), [](const RepulsionPair& pair) { return pair.distance < pair.thickness; });
}

// The mean velocity (x^{n+1} - x^n) / dt changes with the positions, and v-^n changes by the same amount.
void collide_surfaces(World& world, StepContext& context) {
  check_finite(world, Stage::self_collision);
  Particles& particles = world.bodies.particles;
  context.states.x_next = particles.x;
  const SelfCollision::Outcome outcome =
      context.surfaces.collision.resolve(world.bodies.collision_surface, context.states.x_n,
                                         particles.inverse_mass, context.surfaces.candidates, particles.x);
  world.counters.self_collisions += outcome.impulses;
  world.counters.impact_zone_particles += outcome.zone_particles;
  if (outcome.unresolved) fail(world, *outcome.unresolved);
  for (std::size_t p = 0; p < particles.size(); ++p)
    particles.v[p] += (particles.x[p] - context.states.x_next[p]) / context.dt;
}

}  // namespace duet
