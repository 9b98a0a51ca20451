// Fast bodies do not pass through others, however thin. The time step ends before bodies that can meet have
// met, and then takes them no deeper into each other than the thinner one allows.
#include <algorithm>
#include <cmath>

#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/contact/detection/max_penetration.h"
#include "sim/simulation/simulation.h"
#include "sim/step/step.h"

namespace duet::fast_bodies_test {
namespace {

// Makes the body static.
scene::RigidBody& make_static(scene::RigidBody& body) {
  body.is_static = true;
  body.mass.reset();
  return body;
}

// Shapes of bullets.
enum class Bullet { ball, box };

// A bullet and a plate.
struct Shot {
  const char* name;
  Bullet bullet;
  double speed;      // m/s
  double thickness;  // m, of the plate
  bool plate_is_static;
  bool spins = false;
};

void PrintTo(const Shot& shot, std::ostream* out) { *out << shot.name; }

// Returns a bullet of 5 cm at an angle and off the middle of a plate of 0.6 m, at most a frame's motion away
// from it.
scene::Scene shot_at_plate(const Shot& shot) {
  scene::Scene scene = test::free_space();
  auto& plate = test::add_box(scene, "plate", Vec3(0, 0, 0), Vec3(0.6, 0.6, shot.thickness), 1);
  if (shot.plate_is_static) make_static(plate);
  const Vec3 direction = Vec3(0.2, -0.1, -1).normalized();
  const Vec3 start = Vec3(0.031, 0.047, 0) - 0.6 * shot.speed / 24 * direction;
  auto& bullet = shot.bullet == Bullet::ball
                     ? test::add_ball(scene, "bullet", start, 0.025, 0.5)
                     : test::add_box(scene, "bullet", start, Vec3(0.05, 0.05, 0.05), 0.5);
  bullet.placement.velocity = shot.speed * direction;
  bullet.restitution = 0.3;
  if (shot.spins) bullet.placement.angular_velocity = Vec3(100, 200, 50);
  return scene;
}

class FastBullet : public testing::TestWithParam<Shot> {};

// The bullet must hit the plate, never be on its other side, and never be deeper than half of its thickness,
// in less than 20,000 steps. Detection at the ends of steps alone misses a plate of 1 mm at 500 m/s.
TEST_P(FastBullet, DoesNotPassThroughThePlate) {
  const Shot& shot = GetParam();
  const scene::Scene scene = shot_at_plate(shot);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  const auto& state = world.bodies.rigid.state;
  const double speed = shot.speed;
  Vec3 before = state[0].pose.to_body(state[1].pose.position);  // m, of the bullet in the plate's body frame
  double time = 0, min_distance = before.norm();
  int steps = 0;
  for (; time < 3.0 / 24 && steps < 20000; ++steps) {
    const double dt = choose_time_step(world, time);
    step(world, time, dt);
    time += dt;
    const Vec3 now = state[0].pose.to_body(state[1].pose.position);
    // A free plate turns, and the bullet may come to its other side around its edge, but not through it.
    const Vec3 crossing = before + before.z() / (before.z() - now.z()) * (now - before);
    if ((before.z() > 0) != (now.z() > 0)) {
      EXPECT_GT(std::max(std::abs(crossing.x()), std::abs(crossing.y())), 0.3) << "at " << time << " s";
    }
    EXPECT_LE(max_penetration(world.bodies, world.contact_filter()), shot.thickness / 2);
    before = now;
    min_distance = std::min(min_distance, std::abs(now.z()));
  }
  EXPECT_GE(time, 3.0 / 24);
  EXPECT_LT(min_distance, 0.06) << "it came near the plate";
  EXPECT_GT((state[1].velocity - scene.rigid[1].placement.velocity).norm(), 0.3 * speed) << "it was hit";
  std::printf("%d substeps\n", steps);
}

INSTANTIATE_TEST_SUITE_P(Shots, FastBullet,
                         testing::Values(Shot{"ball_500", Bullet::ball, 500, 0.02, true},
                                         Shot{"box_500", Bullet::box, 500, 0.02, true},
                                         Shot{"spinning_box_500", Bullet::box, 500, 0.02, true, true},
                                         Shot{"ball_500_free_plate", Bullet::ball, 500, 0.02, false},
                                         Shot{"box_500_free_plate", Bullet::box, 500, 0.02, false},
                                         Shot{"ball_500_card", Bullet::ball, 500, 0.001, true},
                                         Shot{"box_500_card", Bullet::box, 500, 0.001, true},
                                         Shot{"ball_500_free_card", Bullet::ball, 500, 0.001, false},
                                         Shot{"box_500_free_card", Bullet::box, 500, 0.001, false},
                                         Shot{"ball_5000_card", Bullet::ball, 5000, 0.001, true}),
                         [](const auto& shot) { return shot.param.name; });

// A ball at 100 m/s must carry the thin soft wall along.
TEST(FastBodies, ABallDoesNotPassThroughAThinSoftWall) {
  scene::Scene scene = test::free_space();
  auto& wall = test::add_soft_box(scene, "wall", Vec3(0, 0, 0), Vec3(1, 1, 0.1), 1);
  wall.shape.cells = Vec3i(10, 10, 1);
  auto& ball = test::add_ball(scene, "ball", Vec3(0.02, 0.03, 1.5), 0.1, 4);
  ball.placement.velocity = Vec3(0, 0, -100);
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  for (int frame = 0; frame < 2; ++frame) simulation.advance_frame();
  // The wall's particles near the ball's path have been carried along in front of it.
  const Vec3 center = bodies.rigid.state[0].pose.position;
  for (const Vec3& x : bodies.particles.x) {
    const Vec3 from_ball = x - center;
    if (std::hypot(from_ball.x(), from_ball.y()) < 0.08) {
      EXPECT_LT(from_ball.z(), 0);
    }
  }
  EXPECT_LT(simulation.stats().max_penetration, 0.01);
  EXPECT_GT(bodies.rigid.state[0].velocity.z(), -95);
}

// The tip of a spinning bar moves at 180 m/s where the ball is: bounds on motion within a step must include
// rotation.
TEST(FastBodies, ASpinningBarHitsABall) {
  scene::Scene scene = test::free_space();
  test::add_box(scene, "bar", Vec3(0, 0, 0), Vec3(2, 0.03, 0.03), 5).placement.angular_velocity =
      Vec3(0, 0, 200);
  test::add_ball(scene, "ball", Vec3(0.05, 0.9, 0), 0.05, 0.5).restitution = 0.5;
  Simulation simulation(scene, test::plan(scene));
  simulation.advance_frame();
  const auto& state = simulation.world().bodies.rigid.state;
  EXPECT_LT(state[1].velocity.x(), -100) << "its tip moves at 200 m/s";
  EXPECT_LT(simulation.stats().max_penetration, 0.015);
}

// A body that a fast one strikes becomes as fast within the step, and a card is right behind it. A step that
// is chosen for the velocities before the impact lets it pass through the card.
TEST(FastBodies, AStruckBodyDoesNotPassThroughWhatIsBehindIt) {
  for (const double gap : {0.0005, 0.002, 0.01}) {
    scene::Scene scene = test::free_space();
    make_static(test::add_box(scene, "card", Vec3(0, 0, -0.0005), Vec3(0.6, 0.6, 0.001), 1));
    test::add_box(scene, "struck", Vec3(0, 0, 0.1 + gap), Vec3(0.2, 0.2, 0.2), 0.5);
    test::add_box(scene, "bullet", Vec3(0, 0, 4), Vec3(0.2, 0.2, 0.2), 50).placement.velocity.z() = -500;
    Simulation simulation(scene, test::plan(scene));
    const auto& state = simulation.world().bodies.rigid.state;
    for (int frame = 0; frame < 3; ++frame) {
      simulation.advance_frame();
      const Vec3 x = state[1].pose.position;
      EXPECT_TRUE(x.z() > 0 || std::max(std::abs(x.x()), std::abs(x.y())) > 0.3) << x.transpose();
    }
    EXPECT_LT(std::abs(state[2].velocity.z()), 400) << "it was struck, gap " << gap;
  }
}

// A fast body shortens the step only if it can meet another one.
TEST(FastBodies, ThatMeetNothingTakeNoShorterSteps) {
  scene::Scene scene = test::on_ground();
  test::add_ball(scene, "bullet", Vec3(0, 30, 0), 0.025, 0.5).placement.velocity = Vec3(500, 0, 0);
  make_static(test::add_box(scene, "card", Vec3(-3, 30, 0), Vec3(1, 1, 0.001), 1));
  test::add_box(scene, "beside", Vec3(10, 31, 0), Vec3(1, 1, 1), 1).placement.velocity = Vec3(0, 0, 100);
  Simulation simulation(scene, test::plan(scene));
  const TimeStepChoice choice = bounded_time_step(simulation.world(), 0);
  EXPECT_EQ(choice.bound, TimeStepBound::setting);
  for (int frame = 0; frame < 2; ++frame) {
    simulation.advance_frame();
    EXPECT_EQ(simulation.stats().substeps, 2);  // max_time_step = 1/48 s
  }
}

}  // namespace
}  // namespace duet::fast_bodies_test
