#include "sim/scene/build/body_damping.h"

#include <cmath>
#include <numbers>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/step.h"

namespace duet::body_damping_test {
namespace {

using test::expect_below;

// Returns a free rod of 1 m along x with 20 springs of `fraction` times critical damping.
scene::Scene spring_rod(double fraction) {
  scene::Scene scene = test::free_space();
  scene::DeformableBody& rod = test::add_soft_box(scene, "rod", Vec3::Zero(), Vec3(1, 1, 1), 1);
  rod.shape.kind = scene::DeformableKind::rod;
  rod.shape.points = {Vec3(-0.5, 0, 0), Vec3(0.5, 0, 0)};
  rod.shape.segments = 20;
  rod.thickness = 0.02;
  scene.materials[0].has_springs = true;
  scene.materials[0].springs = {1000, fraction};
  scene.materials[0].bending_factor = 0;
  return scene;
}

// Returns a free cube of 1 m of springs.
scene::Scene spring_cube(double fraction) {
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "cube", Vec3::Zero(), Vec3(1, 1, 1), 3);
  scene.materials[0].has_springs = true;
  scene.materials[0].springs = {1e4, fraction};
  return scene;
}

// Returns the time (s) in which the strain of a body that is released at 1.01 times its length falls to
// exp(-1).
double relaxation_time(const scene::Scene& scene) {
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (Vec3& x : world.bodies.particles.x) x.x() *= 1.01;
  const double start = world.bodies.forces.energy(world.bodies.particles.x),
               dt = 0.01 * world.damping_time[0];
  double strain = 1, before = 1, time = 0;
  for (int i = 0; i < 500 && strain > std::exp(-1); ++i) {
    step(world, 0, dt);
    before = strain;
    strain = std::sqrt(world.bodies.forces.energy(world.bodies.particles.x) / start);
    time += dt;
  }
  return time - dt * (std::exp(-1) - strain) / (before - strain);
}

// The springs of a rod with N pieces have w = 2 sqrt(k/m) sin(pi / 2N), and f times critical damping between
// two masses m is tau = sqrt(2) f sqrt(m/k). Elements of a bar have w = pi / L sqrt(E / rho) and the tau of
// their material. Both are strongly damped from tau w = 20 on.
TEST(BodyDamping, OneLimitHoldsForSpringsAndElements) {
  const double of_critical = std::numbers::sqrt2 * std::numbers::pi / 20;  // tau w over f
  const double w = std::numbers::pi * std::sqrt(2e6 / 1000);               // of the elements
  for (const bool is_strong : {false, true}) {
    const double tau_w = is_strong ? 21.5 : 18.5;  // the ends of the rod have half a mass
    scene::Scene springs = spring_rod(tau_w / of_critical), elements = spring_cube(0);
    elements.materials[0].has_springs = false;
    elements.materials[0].youngs_modulus = 2e6;
    elements.materials[0].damping = tau_w / w;
    for (const scene::Scene& scene : {springs, elements}) {
      const Simulation simulation(scene, test::plan(scene));
      EXPECT_EQ(simulation.world().strongly_damped[0] != 0, is_strong) << tau_w;
    }
  }
}

// The mass of a body, if it is given, decides and not the density of the material.
TEST(BodyDamping, FollowsTheMassOfTheBody) {
  scene::Scene scene = spring_cube(0);
  scene.materials[0].has_springs = false;
  scene.materials[0].youngs_modulus = 2e6;
  scene.materials[0].damping = 21 / (std::numbers::pi * std::sqrt(2e6 / 1000));
  for (const double mass : {500.0, 2000.0}) {
    scene.deformable[0].mass = mass;
    const Simulation simulation(scene, test::plan(scene));
    EXPECT_EQ(simulation.world().strongly_damped[0] != 0, mass < 1000) << mass;
  }
}

// A strongly damped body creeps back to its shape in the time that its damping says.
TEST(BodyDamping, StrainOfSpringsRelaxesInTheDampingTime) {
  for (const scene::Scene& scene : {spring_rod(2000), spring_cube(200)}) {
    const Simulation simulation(scene, test::plan(scene));
    const double time = simulation.world().damping_time[0];
    expect_below(std::abs(relaxation_time(scene) / time - 1), 0.1, "time off");
  }
}

}  // namespace
}  // namespace duet::body_damping_test
