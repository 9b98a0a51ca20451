// Strongly damped soft bodies fall as all bodies do, stay down where they land, and never gain energy,
// however strong the damping.
#include <algorithm>
#include <cmath>

#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::everyday_soft_damping_test {
namespace {

using scene::Integration;

constexpr double gravity = 9.8, density = 1000;  // m/s^2, kg/m^3

// Measurements of a fall.
struct Course {
  double gained = 0;  // largest rise of the energy above an earlier frame, over the energy of the fall
  double flight = 0;  // relative error of the distance fallen
  double moving = 0;  // kinetic energy at the end, over the energy of the fall
};

// Drops a cube by half of its size, and waits longer than it fell.
Course drop(double youngs_modulus, double size, double damping, Integration integration) {
  scene::Scene scene = test::on_ground();
  scene.gravity = Vec3(0, -gravity, 0);
  test::add_soft_box(scene, "soft", Vec3(0, size, 0), Vec3::Constant(size), 2, youngs_modulus);
  scene.materials[0].density = density;
  scene.materials[0].poisson_ratio = 0.3;
  scene.materials[0].damping = damping;
  scene.solver.integration = integration;
  scene.fps = 8 / std::sqrt(size / gravity);  // the fall takes 8 frames
  Simulation simulation(scene, test::plan(scene));
  const double fall = gravity * density * std::pow(size, 4) / 2;  // J
  const double start = simulation.stats().potential;
  Course course;
  double least = start;
  for (int frame = 1; frame <= 20; ++frame) {
    simulation.advance_frame();
    const FrameStats stats = simulation.stats();
    if (frame == 6) course.flight = std::abs((start - stats.potential) / fall / (36.0 / 64) - 1);
    const double energy = stats.kinetic + stats.potential + stats.elastic;
    course.gained = std::max(course.gained, (energy - least) / fall);
    least = std::min(least, energy);
    course.moving = stats.kinetic / fall;
  }
  return course;
}

class EverydaySoftDamping : public testing::TestWithParam<Integration> {};

// Damping gives no energy, does not slow free fall, and keeps a cube whose lowest mode is overdamped from
// rebounding. The integrations used to gain 6 kJ at a damping of 10 s (semi-implicit) and 6e17 J at 100 s
// (implicit). The bounds are measurements with a margin.
TEST_P(EverydaySoftDamping, OnlyTakesEnergy) {
  double gained = 0, flight = 0;
  for (const double youngs_modulus : {1e3, 1e5, 1e7})
    for (const double size : {0.05, 0.5, 5.0})
      for (const double damping : {0.01, 0.1, 1.0, 10.0, 100.0, 1e4, 1e8}) {
        const double speed = std::sqrt(youngs_modulus / density);  // m/s, of elastic waves
        if (gravity * size > 0.1 * speed * speed) continue;        // it would be compressed too far
        if (GetParam() == Integration::semi_implicit && speed > 60 * std::sqrt(size)) continue;  // too slow
        SCOPED_TRACE(fmt::format("{:g} Pa, {:g} m, damping of {:g} s", youngs_modulus, size, damping));
        const Course course = drop(youngs_modulus, size, damping, GetParam());
        EXPECT_LT(course.gained, 1e-3);
        EXPECT_LT(course.flight, 0.01);
        // The lowest mode is overdamped by a factor of more than ten: the cube creeps and does not leave the
        // ground.
        if (damping * speed * EIGEN_PI > 10 * size) {
          EXPECT_LT(course.moving, 0.01);
        }
        gained = std::max(gained, course.gained);
        flight = std::max(flight, course.flight);
      }
  test::expect_below(gained, 1e-3, "energy gained, over that of the fall");
  test::expect_below(flight, 0.01, "way fallen, relative");
}

// A body that is thrown at the ground at an angle turns as it lands. Springs are damped as elements are. Both
// used to gain energy in implicit steps in which Newton's method did not find how strong damping turns with
// the body.
TEST_P(EverydaySoftDamping, OnlyTakesEnergyOfWhatIsThrown) {
  double gained = 0;
  test::Cases cases(3);  // 2 of 4
  for (const bool has_springs : {false, true})
    for (const double damping : {1.0, 1e3}) {
      if (!cases.takes()) continue;
      SCOPED_TRACE(fmt::format("{}, damping of {:g}", has_springs ? "springs" : "elements", damping));
      scene::Scene scene = test::on_ground(0.5);
      scene.gravity = Vec3(0, -gravity, 0);
      scene::DeformableBody& body =
          test::add_soft_box(scene, "soft", Vec3(0, 0.5, 0), Vec3::Constant(0.5), 3, 1e5);
      body.placement.orientation = Quat(Eigen::AngleAxisd(0.35, Vec3::UnitZ()));
      body.placement.velocity = Vec3(3, -3, 0);
      scene::Material& material = scene.materials[0];
      material.poisson_ratio = 0.3;
      material.damping = damping;
      material.has_springs = has_springs;
      material.springs = {2e4, 100 * damping};
      scene.solver.integration = GetParam();
      scene.fps = 48;
      Simulation simulation(scene, test::plan(scene));
      double least = 0, first = 0;
      for (int frame = 0; frame < (test::runs_in_full() ? 24 : 14); ++frame) {
        simulation.advance_frame();
        const FrameStats stats = simulation.stats();
        const double energy = stats.kinetic + stats.potential + stats.elastic;
        if (frame == 0) least = first = energy;
        gained = std::max(gained, (energy - least) / first);
        least = std::min(least, energy);
      }
    }
  test::expect_below(gained, 1e-3, "energy gained, over that of the throw");
}

INSTANTIATE_TEST_SUITE_P(Integrations, EverydaySoftDamping,
                         testing::Values(Integration::semi_implicit, Integration::implicit),
                         [](const auto& integration) {
                           return integration.param == Integration::implicit ? "implicit" : "semi_implicit";
                         });

}  // namespace
}  // namespace duet::everyday_soft_damping_test
