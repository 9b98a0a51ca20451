// Friction of impacts of deformable bodies. Step II.1 gives it to each point by itself (friction_impulse).
#include <cmath>

#include "tests/support/margin.h"
#include "tests/support/thin_bodies.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/step/step.h"

namespace duet::impact_friction_test {
namespace {

enum class Guest { particle, cloth };

// Returns the mean velocity of all particles, m/s.
Vec3 mean_velocity(const Particles& particles) {
  Vec3 momentum = Vec3::Zero();
  double mass = 0;
  for (std::size_t p = 0; p < particles.size(); ++p) {
    momentum += particles.mass[p] * particles.v[p];
    mass += particles.mass[p];
  }
  return momentum / mass;
}

// A particle or a flat cloth comes down on a box at 3 m/s, faster along it, and goes on sliding. It starts so
// near that the first step has the impact; later, the contact at the end of the step before would take most
// of it. The impact takes the velocity across the face and mu times as much along it, from the guest relative
// to the box. Nothing else acts, so that this is the whole braking. With a coefficient that is 1 % too large
// in friction_impulse() the second number is 0.0097.
TEST(ImpactFriction, BrakesByTheCoefficientTimesTheNormalChange) {
  for (const Guest guest : {Guest::particle, Guest::cloth})
    for (const bool is_held : {true, false})
      for (const double mu : {0.2, 0.5}) {
        scene::Scene scene = test::free_space();
        scene::RigidBody& box = test::add_box(scene, "box", Vec3(0, -0.5, 0), Vec3(4, 1, 4), 2000);
        box.friction = mu;
        if (is_held) {
          box.is_static = true;
          box.mass.reset();
        }
        scene::Material& material = test::add_material(scene, "felt");
        material.youngs_modulus = 1e4;
        scene::DeformableBody& body =
            test::add_panel(scene, "guest", Vec3(0, 0.0011, 0), Vec2(0.2, 0.2), 2, 2e-3);
        if (guest == Guest::particle) {
          body.shape = {};
          body.shape.kind = scene::DeformableKind::particle;
          body.shape.radius = 1e-3;
          body.thickness.reset();
          body.mass = 0.01;
        }
        body.placement.velocity = Vec3(-5, -3, 1);
        Simulation simulation(scene, test::plan(scene));
        World& world = simulation.world();
        const Vec3 before = mean_velocity(world.bodies.particles);
        for (int i = 0; i < 10; ++i) step(world, i * 1e-3, 1e-3);
        const RigidState& host = world.bodies.rigid.state[0];
        const Vec3 after = mean_velocity(world.bodies.particles) - point_velocity(host, Vec3(0, 0.5, 0));
        const Vec3 along(-5, 0, 1), change = after - before;
        const std::string name =
            fmt::format("{} on a {} box, mu {}", guest == Guest::cloth ? "cloth" : "particle",
                        is_held ? "held" : "free", mu);
        test::expect_below(std::abs(change.y() / 3 - 1), 2e-3, "normal change: " + name);
        test::expect_below(std::abs(-change.dot(along.normalized()) / (mu * change.y()) - 1), 2e-3,
                           "friction: " + name);
      }
}

}  // namespace
}  // namespace duet::impact_friction_test
