// Time steps beyond the elastic limit, where damping holds the modes that the steps do not resolve
// (`solver.relaxation`).
#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/elastic_state.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/step.h"

namespace duet::strong_damping_test {
namespace {

constexpr double tau = 0.01;  // s

// Returns a free block of 1 m with the damping time tau.
scene::Scene free_block(int cells, double youngs_modulus, double poisson_ratio, double relaxation) {
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "block", Vec3::Zero(), Vec3(1, 1, 1), cells, youngs_modulus);
  scene.materials[0].poisson_ratio = poisson_ratio;
  scene.materials[0].damping = tau;
  scene.solver.relaxation = relaxation;
  return scene;
}

// Returns the fraction of the strain that is left after tau of a block released at 1.01 times its size. It is
// exp(-1) if all modes are overdamped so far that mass hardly matters: the slowest of them, with
// w = 1000 rad/s, is late by 1 / (w tau)^2 = 1 %.
double strain_left(double relaxation) {
  scene::Scene scene = free_block(2, 1e8, 0.49, relaxation);
  scene.solver.cg_tolerance = 1e-6;
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (Vec3& x : world.bodies.particles.x) x *= 1.01;
  const double start = test::mechanical_energy(world), limit = test::rule_step(world);
  if (relaxation > 0) {
    EXPECT_GT(limit, 3 * world.settings.cfl * 2 / std::sqrt(world.bodies.forces.elastic_omega_squared()));
  }
  const auto steps = static_cast<int>(std::ceil(tau / limit));
  for (int i = 0; i < steps; ++i) step(world, 0, tau / steps);
  return std::sqrt(world.bodies.forces.energy(world.bodies.particles.x) / start);
}

// Steps that rely on damping must relax strain in the same time as those that follow stiffness.
TEST(StrongDamping, StrainRelaxesInTheDampingTime) {
  EXPECT_NEAR(strain_left(0), std::exp(-1), 0.01);
  EXPECT_NEAR(strain_left(0.1), std::exp(-1), 0.02);  // of first order: an error of dt / (2 tau) = 3 %
}

// Whatever state a block is released in, its energy falls in every frame, and it comes to rest.
TEST(StrongDamping, EnergyOnlyFalls) {
  struct Start {
    const char* name;
    Vec3 stretch;
    double jitter;  // over the size of a cell
  };
  test::Cases cases(3);  // 4 of 10
  for (const Start& start :
       {Start{"shaken", Vec3(1, 1, 1), 0.25}, Start{"drawn out", Vec3(3, 1, 1), 0},
        Start{"drawn out and shaken", Vec3(2, 2, 1), 0.25}, Start{"squeezed", Vec3(1, 0.3, 1), 0.1},
        Start{"crushed", Vec3(0.4, 0.4, 0.4), 0}})
    for (const double youngs_modulus : {2e6, 2e8}) {
      if (!cases.takes()) continue;
      SCOPED_TRACE(std::string(start.name) + ", " + std::to_string(youngs_modulus));
      constexpr int cells = 4;
      scene::Scene scene = free_block(cells, youngs_modulus, 0.45, 0.1);
      scene.fps = 480;
      Simulation simulation(scene, test::plan(scene));
      World& world = simulation.world();
      std::mt19937 random(11);
      std::uniform_real_distribution<double> jitter(-start.jitter / cells, start.jitter / cells);
      for (Vec3& x : world.bodies.particles.x) {
        x = x.cwiseProduct(start.stretch);
        for (int k = 0; k < 3; ++k) x[k] += jitter(random);
      }
      const double at_start = test::mechanical_energy(world);
      double before = at_start;
      for (int frame = 0; frame < 120; ++frame) {
        simulation.advance_frame();
        const double now = test::mechanical_energy(world);
        ASSERT_LE(now, before + 1e-7 * at_start) << frame;  // tolerance of the solves
        before = now;
      }
      EXPECT_LT(before, 1e-3 * at_start);
      EXPECT_GT(simulation.stats().min_det_F, 0.9);
    }
}

// Returns the height (m), frame by frame, of a ball of 200 kg that falls onto a stiff pad and bounces.
std::vector<double> heights(double relaxation) {
  scene::Scene scene = test::on_ground();
  test::add_soft_box(scene, "pad", Vec3(0, 0.25, 0), Vec3(1, 0.5, 1), test::runs_in_full() ? 4 : 2, 1e8);
  scene.materials[0].damping = tau;
  scene.solver.relaxation = relaxation;
  test::add_ball(scene, "ball", Vec3(0.03, 1.3, 0.02), 0.3, 200);
  scene.fps = 120;
  Simulation simulation(scene, test::plan(scene));
  std::vector<double> found;
  for (int frame = 0; frame < 40; ++frame) {
    simulation.advance_frame();
    found.push_back(simulation.world().bodies.rigid.state[0].pose.position.y());
  }
  return found;
}

// An impact on a strongly damped pad must not depend on whether steps follow its stiffness. The bound is
// 0.2 % of the fall.
TEST(StrongDamping, BlowsOnAPadStayWhatTheyAre) {
  const std::vector<double> follows = heights(0), relies = heights(0.1);
  double difference = 0;
  for (std::size_t i = 0; i < follows.size(); ++i)
    difference = std::max(difference, std::abs(relies[i] - follows[i]));
  test::expect_below(difference, 0.001, "height, m, of a ball that falls by half a meter");
}

}  // namespace
}  // namespace duet::strong_damping_test
