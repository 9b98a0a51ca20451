// Balls rebound to the height that their restitution gives; sliding turns into rolling at the speed that
// friction leaves.
#include <algorithm>
#include <cmath>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>

#include "sim/step/step.h"

namespace duet::rigid_bounce_test {
namespace {

constexpr double gravity = 9.8;  // m/s^2

// Advances to the time `end` (s) by the program's rule for the time step, and calls `look` after every step.
template <class Look>
void run(World& world, double end, Look&& look) {
  for (double time = 0; time < end;) {
    const double dt = std::min(choose_time_step(world, time), end - time);
    step(world, time, dt);
    time += dt;
    look(world.bodies.rigid.state[0]);
  }
}

class Rebound : public testing::TestWithParam<double> {};

// A ball whose lowest point falls from h = 1 m rises to e^2 h. A step that predicts an overlap reverses the
// velocity up to one step's travel, 9 cm, above the ground, with what the ball would gain and lose on that
// path. The highest sampled position is up to half a step from the top of the path. The bound is 1 % of the
// height.
TEST_P(Rebound, ReachesItsHeight) {
  const double restitution = GetParam(), radius = 0.05, height = 1;
  scene::Scene scene = test::on_ground(0.5, restitution);
  test::add_ball(scene, "ball", Vec3(0, height + radius, 0), radius, 1).restitution = restitution;
  Simulation simulation(scene, test::plan(scene));
  const double impact = std::sqrt(2 * height / gravity);
  bool was_hit = false;
  double highest = 0, lowest = height;
  // The run lasts until the next impact; a ball that does not bounce is watched for as long as it fell.
  run(simulation.world(), impact * (1 + 2 * (restitution > 0 ? restitution : 0.5)),
      [&](const RigidState& ball) {
        lowest = std::min(lowest, ball.pose.position.y() - radius);
        was_hit |= lowest < 0.01 && ball.velocity.y() > -0.5 * gravity * impact;
        if (was_hit) highest = std::max(highest, ball.pose.position.y() - radius);
      });
  EXPECT_TRUE(was_hit);
  const double theory = restitution * restitution * height;
  test::expect_below(std::abs(highest - theory), restitution > 0 ? 0.01 * theory : 1e-4, "height_error_m");
  test::expect_below(std::max(0.0, -lowest), 1e-6, "overlap_m");
}

INSTANTIATE_TEST_SUITE_P(Restitution, Rebound, testing::Values(0.0, 0.5, 1.0), [](const auto& restitution) {
  return fmt::format("of_{:.0f}_percent", 100 * restitution.param);
});

// A body that rolls.
struct Roller {
  const char* name;
  double outer_radius;  // m, from the axis of rotation to the ground
  double tube;          // m, radius of the tube; 0: a ball
  double gyration;      // m^2, moment of inertia about the axis over the mass
};

// The inertia over the mass is 2/5 R^2 for a ball and r^2 + 3/4 t^2 for a torus with the radius r and the
// tube t.
const Roller rollers[] = {
    {"ball", 0.5, 0, 0.4 * 0.5 * 0.5},
    {"hoop", 0.5, 0.05, 0.45 * 0.45 + 0.75 * 0.05 * 0.05},
};

class Rolling : public testing::TestWithParam<Roller> {};

// A spinning body that is dropped on the ground slides until friction has turned a part of its spin into
// speed. No force has a moment about the point of contact, so k w = (k + R^2) w', with k the inertia over the
// mass.
TEST_P(Rolling, EndsAtTheTextbookSpeed) {
  const Roller& roller = GetParam();
  const double spin = 8, friction = 0.4, drop = 0.02;
  scene::Scene scene = test::on_ground(friction, 0);
  auto& body = test::add_ball(scene, "body", Vec3(0, roller.outer_radius + drop, 0), roller.outer_radius, 1);
  if (roller.tube > 0) {
    body.shape = {
        .kind = scene::ShapeKind::torus, .radius = roller.outer_radius - roller.tube, .tube = roller.tube};
    body.placement.orientation = Quat(Eigen::AngleAxisd(EIGEN_PI / 2, Vec3::UnitX()));
  }
  body.placement.angular_velocity = Vec3(0, 0, -spin);  // rolls toward +x
  body.friction = friction;
  Simulation simulation(scene, test::plan(scene));
  const double final_speed = roller.gyration / (roller.gyration + roller.outer_radius * roller.outer_radius) *
                             spin * roller.outer_radius;
  const double fall = std::sqrt(2 * drop / gravity), slip = final_speed / (friction * gravity);
  run(simulation.world(), fall + 1.5 * slip, [](const RigidState&) {});
  const RigidState& end = simulation.world().bodies.rigid.state[0];
  test::expect_below(std::abs(end.velocity.x() / final_speed - 1), 0.01, "final_speed_error");
  test::expect_below(std::abs(-end.angular_velocity.z() * roller.outer_radius / final_speed - 1), 0.01,
                     "final_spin_error");
  test::expect_below(std::abs(end.velocity.z()) / final_speed, 1e-3, "sideways_speed");

  // The body must keep rolling, because nothing on a plane takes its speed.
  run(simulation.world(), 2, [](const RigidState&) {});
  test::expect_below(std::abs(end.velocity.x() / final_speed - 1), 0.01, "speed_error_after_2_s");
}

INSTANTIATE_TEST_SUITE_P(Bodies, Rolling, testing::ValuesIn(rollers),
                         [](const auto& roller) { return roller.param.name; });

}  // namespace
}  // namespace duet::rigid_bounce_test
