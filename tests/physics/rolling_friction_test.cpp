// Rolling and spinning friction bring balls to rest when the textbook says.
#include <algorithm>
#include <cmath>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"

#include "sim/step/step.h"

namespace duet::rolling_friction_test {
namespace {

constexpr double gravity = 9.8, radius = 0.5;

// Advances from `begin` to `end` (s), with a shorter last step.
void run(World& world, double begin, double end) {
  for (double time = begin; time < end;) {
    const double dt = std::min(choose_time_step(world, time), end - time);
    step(world, time, dt);
    time += dt;
  }
}

// Returns a ball at rest on the ground.
scene::Scene ball_on_ground() {
  scene::Scene scene = test::on_ground(0.5, 0);
  auto& ball = test::add_ball(scene, "ball", Vec3(0, radius, 0), radius, 2);
  ball.restitution = 0;
  return scene;
}

// The normal force with the lever arm b brakes the rolling, against the inertia 7/5 m R^2 about the point of
// contact: the deceleration is 5/7 b g / R until the ball stops. The ball rests on the ground from the start,
// and a step is exact under constant forces, so the bound is rounding. Only the step in which the ball stops
// may be off, by a dt^2 / 2 = 6e-5 m of 7 m.
TEST(RollingFriction, StopsABallAfterItsDistance) {
  const double b = 0.02, speed = 2, deceleration = 5.0 / 7.0 * b * gravity / radius;
  scene::Scene scene = ball_on_ground();
  scene.rigid[0].rolling_friction = b;
  scene.rigid[0].placement.velocity = Vec3(speed, 0, 0);
  scene.rigid[0].placement.angular_velocity = Vec3(0, 0, -speed / radius);
  Simulation simulation(scene, test::plan(scene));
  const RigidState& ball = simulation.world().bodies.rigid.state[0];
  const double half = speed / deceleration / 2, distance = speed * speed / (2 * deceleration);
  run(simulation.world(), 0, half);
  test::expect_below(std::abs(ball.velocity.x() / (speed / 2) - 1), 1e-12, "speed_error_at_half_time");
  test::expect_below(std::abs(ball.pose.position.x() / (0.75 * distance) - 1), 1e-12,
                     "distance_error_at_half_time");
  test::expect_below(std::abs(-ball.angular_velocity.z() * radius / ball.velocity.x() - 1), 1e-12, "slip");
  run(simulation.world(), half, 2 * half + 1);
  test::expect_below(ball.velocity.norm(), 1e-12, "speed_at_rest_m_s");
  test::expect_below(std::abs(ball.pose.position.x() / distance - 1), 1e-5, "distance_error");
  test::expect_below(std::abs(ball.pose.position.z()), 1e-12, "sideways_m");
}

// Spinning friction: I alpha = b m g with I = 2/5 m R^2, until the ball stops. It must neither move nor turn
// back.
TEST(SpinningFriction, StopsATopAfterItsTime) {
  const double b = 0.01, spin = 4, deceleration = b * gravity / (0.4 * radius * radius);
  scene::Scene scene = ball_on_ground();
  scene.ground->spinning_friction = b;
  scene.rigid[0].placement.angular_velocity = Vec3(0, spin, 0);
  Simulation simulation(scene, test::plan(scene));
  const RigidState& ball = simulation.world().bodies.rigid.state[0];
  const double half = spin / deceleration / 2;
  run(simulation.world(), 0, half);
  test::expect_below(std::abs(ball.angular_velocity.y() / (spin / 2) - 1), 1e-12, "spin_error_at_half_time");
  run(simulation.world(), half, 2 * half + 0.5);
  test::expect_below(ball.angular_velocity.norm(), 1e-12, "spin_at_rest_rad_s");
  test::expect_below((ball.pose.position - Vec3(0, radius, 0)).norm(), 1e-12, "moved_m");
}

}  // namespace
}  // namespace duet::rolling_friction_test
