// Step V: the spin of deformable bodies that nothing touches, which moving their positions would change.
#include "sim/coupling/surface_intersections.h"
#include "sim/deformable/spin.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// The particles' x^{n+1} - x^n is dt v~ with the velocity that I.1 predicts, v~, and V.2's forces act at
// x^{n+1/2}: m (x^{n+1} x v^{n+1} - x^n x v^n) = m (x^{n+1} - x^n) x (v^n + v^{n+1})/2 summed over the body,
// less what the whole of it moves, is gained from nothing. It is of third order in dt.
void keep_spin(const DeformableBody& body, const StepContext& context, Particles& particles) {
  const auto moved = [&](std::size_t p) -> Vec3 { return particles.x[p] - context.x_n[p]; };
  const MassMoments moments = mass_moments(body, particles);
  Vec3 way = Vec3::Zero(), gained = Vec3::Zero();
  for_each_particle(body, [&](std::size_t p) { way += particles.mass[p] / moments.mass * moved(p); });
  for_each_particle(body, [&](std::size_t p) {
    gained += particles.mass[p] / 2 * (moved(p) - way).cross(context.v_n.particle[p] + particles.v[p]);
  });
  const Vec3 rate = rate_of_turn(moments, gained);
  for_each_particle(body,
                    [&](std::size_t p) { particles.v[p] -= rate.cross(particles.x[p] - moments.centre); });
}

}  // namespace

void find_untouched(World& world, StepContext& context) {
  const Bodies& bodies = world.bodies;
  const Particles& particles = bodies.particles;
  std::vector<char>& untouched = context.untouched;
  untouched.assign(bodies.deformable.size(), 1);
  for (std::size_t d = 0; d < bodies.deformable.size(); ++d)
    for_each_particle(bodies.deformable[d], [&](std::size_t p) {
      if (is_held(particles, p) || particles.v[p] != context.v_n.particle[p]) untouched[d] = 0;
    });
  for (const auto& [rigid, deformable] : bodies.apart_deformable)  // tied to it
    untouched[static_cast<std::size_t>(deformable)] = 0;
  for (const ContactPair& pair : context.contacts.pairs)
    for (int i = pair.begin; i < pair.end && pair.guest_deformable >= 0; ++i)
      if (!context.contacts.points[static_cast<std::size_t>(i)].impulse.isZero(0))
        untouched[static_cast<std::size_t>(pair.guest_deformable)] = 0;
  if (!world.has(Effect::self_repulsion)) return;
  for (const RepulsionPair& pair : context.self_repulsion.pairs())
    for (const int p : pair.particle) untouched[body_of(bodies, p)] = 0;
}

void keep_spin(World& world, StepContext& context) {
  Bodies& bodies = world.bodies;
  for (std::size_t d = 0; d < bodies.deformable.size(); ++d)
    if (context.untouched[d] != 0) keep_spin(bodies.deformable[d], context, bodies.particles);
}

}  // namespace duet
