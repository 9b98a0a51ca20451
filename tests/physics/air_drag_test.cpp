// Air drag in free fall against its closed form: a body with a terminal speed v_t falls by v' = g - k |v| v
// with k = g / v_t^2, and a body without one does not feel the air.
#include <cmath>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::air_drag_test {
namespace {

constexpr double g = 9.8, terminal = 5;  // m/s^2, m/s

// Returns a rigid ball, a soft box and a particle with a terminal speed, and a ball without one, dropped from
// rest.
scene::Scene falling(double max_time_step) {
  scene::Scene scene;
  scene.title = "test";
  test::add_ball(scene, "ball", Vec3(0, 0, 0), 0.5, 3).terminal_speed = terminal;
  test::add_soft_box(scene, "box", Vec3(3, 0, 0), Vec3(1, 1, 1), 2, 1e5).terminal_speed = terminal;
  scene::DeformableBody particle = scene.deformable.back();
  particle.name = "particle";
  particle.shape.kind = scene::DeformableKind::particle;
  particle.shape.radius = 0.1;
  particle.placement.position = Vec3(6, 0, 0);
  scene.deformable.push_back(particle);
  test::add_ball(scene, "free", Vec3(9, 0, 0), 0.5, 3);
  scene.solver.max_time_step = max_time_step;
  return scene;
}

// Depth and speed of a fall.
struct Fall {
  double depth = 0, speed = 0;  // m, m/s
};

// Returns depth and speed after one second of, in this order, the ball, the box's center of mass, the
// particle and the ball without drag.
std::array<Fall, 4> after_a_second(double max_time_step) {
  const scene::Scene scene = falling(max_time_step);
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
  const Bodies& bodies = simulation.world().bodies;
  const auto rigid = [&](std::size_t i) {
    return Fall{-bodies.rigid.state[i].pose.position.y(), -bodies.rigid.state[i].velocity.y()};
  };
  const auto soft = [&](std::size_t i) {
    Fall mean;
    double mass = 0;
    const DeformableBody& body = bodies.deformable[i];
    for (int k = 0; k < body.particle_count; ++k) {
      const auto p = static_cast<std::size_t>(body.first_particle + k);
      mean.depth -= bodies.particles.mass[p] * bodies.particles.x[p].y();
      mean.speed -= bodies.particles.mass[p] * bodies.particles.v[p].y();
      mass += bodies.particles.mass[p];
    }
    return Fall{mean.depth / mass, mean.speed / mass};
  };
  return {rigid(0), soft(0), soft(1), rigid(1)};
}

// Drag of order v^2 from rest gives v = v_t tanh(g t / v_t) and a depth of (v_t^2 / g) ln cosh(g t / v_t). A
// wrong coefficient or the velocity of the wrong time in the drag changes the value or the order of the
// error.
TEST(AirDrag, FallIsTheClosedForm) {
  const double speed = terminal * std::tanh(g / terminal);
  const double depth = terminal * terminal / g * std::log(std::cosh(g / terminal));
  const auto coarse = after_a_second(1.0 / 192), fine = after_a_second(1.0 / 384);
  for (std::size_t i = 0; i < 3; ++i) {
    // The error is of second order in the step. It was measured as 1.2e-5 at a step of 1/192 s.
    test::expect_below(std::abs(coarse[i].speed / speed - 1), 2e-5, "speed");
    test::expect_below(std::abs(coarse[i].depth / depth - 1), 2e-5, "depth");
  }
  // At second order, half the step leaves a quarter of the error.
  EXPECT_NEAR((coarse[0].speed - speed) / (fine[0].speed - speed), 4, 0.2);
  EXPECT_NEAR((coarse[0].depth - depth) / (fine[0].depth - depth), 4, 0.2);
  EXPECT_NEAR(coarse[3].speed, g, 1e-12) << "no drag was asked for";
  EXPECT_NEAR(coarse[3].depth, g / 2, 1e-12);
}

// Drag is an external force along the velocity: the ledger must book all the momentum that it takes, and it
// acts at the center of mass, so it changes no spin. The bound on momentum is rounding, over masses of some
// 1000 kg.
TEST(AirDrag, IsFromOutsideAndLeavesSpinAlone) {
  scene::Scene scene = falling(1.0 / 48);
  scene.rigid[0].placement.angular_velocity = Vec3(1, 2, 3);
  scene.rigid[0].placement.velocity = Vec3(-20, 5, -3);
  Simulation simulation(scene, test::plan(scene));
  simulation.keep_ledger();
  const Vec3 spin = simulation.world().bodies.rigid.state[0].angular_momentum;
  for (int frame = 0; frame < 6; ++frame) {
    const Vec3 before = simulation.stats().momentum;
    simulation.advance_frame();
    const LedgerStats step = simulation.stats().ledger.back();
    const Vec3 change = simulation.stats().momentum - before;
    test::expect_below((change - step.external_momentum).norm() / 1000, 1e-12, "momentum");
    EXPECT_LT(simulation.stats().kinetic, 1e6);
  }
  EXPECT_LT((simulation.world().bodies.rigid.state[0].angular_momentum - spin).norm(), 1e-12 * spin.norm());
  EXPECT_GT(simulation.world().bodies.rigid.state[0].velocity.x(), -10) << "drag acts in every direction";
}

// A scene in which no body has a terminal speed must not run the stage.
TEST(AirDrag, IsEnteredOnlyWhereAskedFor) {
  scene::Scene scene = falling(1.0 / 48);
  for (scene::RigidBody& body : scene.rigid) body.terminal_speed.reset();
  for (scene::DeformableBody& body : scene.deformable) body.terminal_speed.reset();
  Simulation simulation(scene, test::plan(scene));
  simulation.advance_frame();
  EXPECT_EQ(simulation.world().clock[Stage::air_drag].calls, 0);
}

}  // namespace
}  // namespace duet::air_drag_test
