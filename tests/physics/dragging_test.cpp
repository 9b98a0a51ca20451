// Friction drags soft bodies by as much as the friction cone allows, whatever their damping.
#include <cmath>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::dragging_test {
namespace {

using scene::Integration;
using test::expect_below;

// State of the slab after a second.
struct Dragged {
  double shear = 0;     // m, mean displacement of the lower face
  double friction = 0;  // horizontal over vertical component of the elastic force on the free particles
  double stretch = 0;   // largest stretch of an element
};

// Simulates a slab of 0.4 x 0.2 x 0.4 m that hangs from its upper face and is squeezed by a tenth against a
// belt below it, which runs at 1 m/s, for one second.
Dragged dragged(double friction, double damping, Integration integration) {
  constexpr int cells = 2;
  scene::Scene scene = test::free_space();
  scene::RigidBody& belt = test::add_box(scene, "belt", Vec3(0, -0.5, 0), Vec3(20, 1, 4), 1e9);
  belt.placement.velocity = Vec3(1, 0, 0);
  belt.friction = friction;
  scene::DeformableBody& slab =
      test::add_soft_box(scene, "slab", Vec3(0, 0.1, 0), Vec3(0.4, 0.2, 0.4), cells, 2e5);
  scene.materials.back().damping = damping;
  for (const double x : {-0.2, 0.0, 0.2})
    for (const double z : {-0.2, 0.0, 0.2}) slab.pins.push_back({Vec3(x, 0.1, z), {}, 1e-3, {}});
  scene.solver.integration = integration;
  if (integration == Integration::implicit) scene.solver.max_time_step = 1.0 / 480;
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  std::vector<Vec3>& x = bodies.particles.x;
  for (Vec3& place : x) place.y() *= 0.9;
  for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();

  Dragged result{.stretch = simulation.stats().max_stretch};
  std::vector<Vec3> force(x.size(), Vec3::Zero());
  bodies.forces.add_elastic_forces(x, force);
  Vec3 sum = Vec3::Zero();
  int lowest = 0;
  for (std::size_t p = 0; p < x.size(); ++p) {
    if (is_held(bodies.particles, p)) continue;
    sum += force[p];
    if (x[p].y() > 0.01) continue;
    result.shear += x[p].x();
    ++lowest;
  }
  result.shear /= lowest;
  result.friction = std::hypot(sum.x(), sum.z()) / std::abs(sum.y());
  return result;
}

// In steady sliding the elastic force must lie on the friction cone, |F_t| = mu F_n, and the shear must not
// depend on the damping. Friction that saw only the masses of the particles, without their damping, would
// stretch the most damped slab to eleven times its size. The bounds of 2 and 3 % are measurements with a
// margin.
TEST(Dragging, IsByTheFrictionOfItsConeHoweverDamped) {
  for (const double friction : {0.2, 0.5}) {
    const double shear = dragged(friction, 0.001, Integration::semi_implicit).shear;
    for (const double damping : {0.001, 0.01, 0.1}) {
      const Dragged slab = dragged(friction, damping, Integration::semi_implicit);
      expect_below(std::abs(slab.friction / friction - 1), 0.02, "friction, relative");
      expect_below(std::abs(slab.shear / shear - 1), 0.02, "shear, relative");
      expect_below(slab.stretch, 1.2, "stretch");
    }
    // The implicit integration runs with 20 steps a frame.
    const Dragged slab = dragged(friction, 0.01, Integration::implicit);
    expect_below(std::abs(slab.friction / friction - 1), 0.03, "friction, implicit, relative");
  }
}

}  // namespace
}  // namespace duet::dragging_test
