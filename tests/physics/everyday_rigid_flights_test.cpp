// Two bodies that both move meet in flight. Impulses act when the bodies meet, and not at the beginning of
// the step in which they do, so that velocities, places and spins are those of the exact impact.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/random_scenes.h"
#include <fmt/format.h>

#include "sim/step/world.h"

namespace duet::everyday_rigid_flights_test {
namespace {

using scene::Shape;
using scene::ShapeKind;

// Returns a vector with components of up to `largest`.
Vec3 vector(test::Draw& draw, double largest) {
  Vec3 v;
  for (int k = 0; k < 3; ++k) v[k] = draw(-largest, largest);
  return v;
}

// Two balls that touch first at the time `meeting` (s), with the first one's center in the direction
// -`normal` from the second one's.
struct TwoBalls {
  double radius[2] = {}, mass[2] = {};  // m, kg
  Vec3 velocity[2], at_meeting[2];      // m/s, m
  Vec3 normal;
  double meeting = 0, restitution = 0, friction = 0;
  double approach() const { return (velocity[0] - velocity[1]).dot(normal); }
};

TwoBalls random_balls(test::Draw& draw, double size) {
  TwoBalls balls;
  for (int i = 0; i < 2; ++i) {
    balls.radius[i] = size * draw(0.5, 2);
    balls.mass[i] = draw(0.5, 5);
  }
  const Vec3 direction = vector(draw, 1).normalized();
  balls.normal = (direction + 0.9 * vector(draw, 1).normalized()).normalized();  // up to 64 degrees off
  const double speed = size * draw(5, 200);
  balls.velocity[1] = speed * vector(draw, 1);
  balls.velocity[0] = balls.velocity[1] + speed * direction;
  balls.at_meeting[1] = size * vector(draw, 1);
  balls.at_meeting[0] = balls.at_meeting[1] - (balls.radius[0] + balls.radius[1]) * balls.normal;
  balls.meeting = draw(0.05, 0.25);
  // Every other pair meets almost at the end of a step.
  if (draw.below(2) == 0)
    balls.meeting = std::round(48 * balls.meeting) / 48 + draw(-2e-4, 2e-4) * size / speed;
  balls.restitution = 0.5 * draw.below(3);
  balls.friction = draw(-1, 1) < 0 ? 0 : 0.3;
  return balls;
}

scene::Scene scene_of(const TwoBalls& balls, double max_step) {
  scene::Scene scene = test::free_space();
  if (max_step > 0) scene.solver.max_time_step = max_step;
  for (int i = 0; i < 2; ++i) {
    const Vec3 start = balls.at_meeting[i] - balls.meeting * balls.velocity[i];
    scene::RigidBody& ball = test::add_ball(scene, fmt::format("ball{}", i), start, balls.radius[i], 1);
    ball.density.reset();
    ball.mass = balls.mass[i];
    ball.placement.velocity = balls.velocity[i];
    ball.restitution = balls.restitution;
    ball.friction = balls.friction;
  }
  return scene;
}

// Impulses at the beginning of the step gave balls without friction a spin of up to a tenth of their speed,
// and restitutions that were off by 0.09.
TEST(EverydayRigidFlights, BallsLeaveAsTheExactImpactSays) {
  constexpr double rounding = 1e-11;  // of some hundred operations, times the paths over the radii
  double most_place = 0, most_velocity = 0, most_spin = 0, most_restitution = 0, most_angular = 0;
  const int seeds = test::runs_in_full() ? 2000 : 100;
  for (int seed = 0; seed < seeds; ++seed) {
    test::Draw draw(static_cast<std::uint64_t>(seed));
    const double size = std::vector{0.001, 0.1, 10.0}[static_cast<std::size_t>(seed) % 3];
    const TwoBalls balls = random_balls(draw, size);
    const scene::Scene scene = scene_of(balls, seed % 4 == 3 ? 0.002 : 0);
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 0; frame < 8; ++frame) simulation.advance_frame();
    const RigidBodies& rigid = simulation.world().bodies.rigid;
    const double speed = (balls.velocity[0] - balls.velocity[1]).norm(), after = 8.0 / 24 - balls.meeting;
    const double left = (rigid.state[1].velocity - rigid.state[0].velocity).dot(balls.normal);
    const double restitution = std::abs(left / balls.approach() - balls.restitution);
    EXPECT_LT(restitution, rounding) << "seed " << seed;
    most_restitution = std::max(most_restitution, restitution);
    Vec3 angular = Vec3::Zero();
    for (int i = 0; i < 2; ++i) {
      const RigidState& state = rigid.state[static_cast<std::size_t>(i)];
      angular += balls.mass[i] * (state.pose.position.cross(state.velocity) -
                                  balls.at_meeting[i].cross(balls.velocity[i])) +
                 state.angular_momentum;
      if (balls.friction > 0) continue;
      const double mass = balls.mass[0] * balls.mass[1] / (balls.mass[0] + balls.mass[1]);
      const double impulse = (1 + balls.restitution) * mass * balls.approach() * (i == 0 ? -1 : 1);
      const Vec3 velocity = balls.velocity[i] + impulse / balls.mass[i] * balls.normal;
      const Vec3 place = balls.at_meeting[i] + after * velocity;
      most_velocity = std::max(most_velocity, (state.velocity - velocity).norm() / speed);
      most_place = std::max(most_place, (state.pose.position - place).norm() / size);
      most_spin = std::max(most_spin, balls.radius[i] * state.angular_velocity.norm() / speed);
    }
    most_angular = std::max(most_angular, angular.norm() / (balls.mass[0] * speed * size));
  }
  EXPECT_LT(most_velocity, rounding);
  EXPECT_LT(most_place, rounding);
  EXPECT_LT(most_spin, rounding);
  EXPECT_LT(most_angular, 10 * rounding);
  test::record_margin("most_error_of_restitution", most_restitution, "below 1e-11");
  test::record_margin("most_error_of_velocity", most_velocity, "below 1e-11");
  test::record_margin("most_error_of_place", most_place, "below 1e-11");
  test::record_margin("most_spin", most_spin, "below 1e-11");
  test::record_margin("most_change_of_angular_momentum", most_angular, "below 1e-10");
}

// A ball and a body of any shape that tumbles fly towards each other, without friction and with a restitution
// of 1. The ball keeps its spin. Balls that met a box at an edge were given the normal of a face beside it,
// which took up to 43 % of the energy, and those that met the rim of a cylinder were struck at two places.
TEST(EverydayRigidFlights, BallsMeetTumblingBodiesWithoutSpin) {
  const std::vector<Shape> shapes{{.kind = ShapeKind::sphere, .radius = 0.12},
                                  {.kind = ShapeKind::box, .size = Vec3(0.4, 0.2, 0.3)},
                                  {.kind = ShapeKind::capsule, .radius = 0.1, .length = 0.3},
                                  {.kind = ShapeKind::cylinder, .radius = 0.15, .length = 0.2},
                                  {.kind = ShapeKind::torus, .radius = 0.2, .tube = 0.12}};
  double most_energy = 0, most_angular = 0, most_spin = 0;
  int met = 0;
  const int seeds = test::runs_in_full() ? 1000 : 100;
  for (int seed = 0; seed < seeds; ++seed) {
    test::Draw draw(static_cast<std::uint64_t>(seed));
    scene::Scene scene = test::free_space();
    for (int i = 0; i < 2; ++i) {
      scene::RigidBody body;
      body.name = fmt::format("body{}", i);
      body.shape = shapes[seed % 2 == i ? 0 : static_cast<std::size_t>(draw.below(5))];
      body.density = 1000;
      body.friction = 0;
      body.restitution = 1;
      const Vec3 velocity(i == 0 ? 3 : -2, 0, 0);
      body.placement.position = -0.25 * velocity + vector(draw, 0.06);
      body.placement.velocity = velocity;
      body.placement.angular_velocity = vector(draw, 4);
      body.placement.orientation = exponential(vector(draw, 3));
      scene.rigid.push_back(body);
    }
    Simulation simulation(scene, test::plan(scene));
    const Bodies& bodies = simulation.world().bodies;
    const double energy = kinetic_energy(bodies);
    const Momentum before = momentum(bodies);
    std::vector<double> spin;
    for (const RigidState& state : bodies.rigid.state) spin.push_back(state.angular_velocity.norm());
    for (int frame = 0; frame < 12; ++frame) simulation.advance_frame();
    const double off = std::abs(kinetic_energy(bodies) / energy - 1);
    EXPECT_LT(off, 1e-6) << "seed " << seed;
    most_energy = std::max(most_energy, off);
    const double scale = 0.2 * 3 * bodies.rigid.properties[0].mass;
    most_angular = std::max(most_angular, (momentum(bodies).angular - before.angular).norm() / scale);
    if (bodies.rigid.state[0].velocity.x() < 2.99) ++met;
    for (std::size_t i = 0; i < 2; ++i)
      if (scene.rigid[i].shape.kind == ShapeKind::sphere)
        most_spin = std::max(most_spin, std::abs(bodies.rigid.state[i].angular_velocity.norm() - spin[i]));
  }
  EXPECT_LT(most_angular, 1e-9);
  EXPECT_LT(most_spin, 1e-9);
  EXPECT_GT(met, seeds / 2);
  test::record_margin("most_change_of_energy", most_energy, "each below 1e-6");
  test::record_margin("most_change_of_angular_momentum", most_angular, "below 1e-9");
  test::record_margin("most_change_of_spin_of_balls", most_spin, "rad/s, below 1e-9");
}

}  // namespace
}  // namespace duet::everyday_rigid_flights_test
