#include "sim/contact/response/contact_solver.h"

#include <algorithm>
#include <cmath>

#include "tests/support/contacts.h"
#include <gtest/gtest.h>

#include "sim/contact/response/warm_start.h"

namespace duet::contact_solver_test {
namespace {

using test::ContactScene;

constexpr double dt = 1.0 / 64, g = 9.8;

// Returns a ball of 2 kg with a radius of 0.5 m that touches the ground.
ContactScene ball_on_ground(double rolling, double spinning, double friction = 0.5) {
  scene::Scene scene = test::on_ground(friction);
  scene.ground->rolling_friction = rolling;
  auto& ball = test::add_ball(scene, "ball", Vec3(0, 0.5, 0), 0.5, 2);
  ball.friction = friction;
  ball.spinning_friction = spinning;  // a pair uses the larger value of both bodies
  return {scene, dt};
}

// Sets the velocity (m/s) and angular velocity (rad/s) of the ball.
void set_motion(ContactScene& ball, const Vec3& velocity, const Vec3& spin) {
  ball.state(0).velocity = velocity;
  set_angular_velocity(ball.state(0), ball.bodies.rigid.properties[0], spin);
}

constexpr ContactSolveSettings exact = {.iterations = 5000, .tolerance = 1e-15, .angular_friction = true};

// Solves the contacts of a scene without a contact cache.
void solve(ContactScene& scene, const ContactSolveSettings& settings) {
  find_speculative_targets(dt, OrientationUpdate::exact, scene.graph, scene.bodies, scene.contacts);
  warm_start({}, dt, scene.graph, scene.bodies, scene.contacts);
  ContactSolveScratch scratch;
  solve_contact(scene.bodies, scene.graph, settings, scene.contacts, scratch);
}

// About the point of contact the weight's impulse m g dt has the moment b m g dt against rolling, where b (m)
// is the lever arm of rolling friction, and the ball has the inertia 7/5 m R^2. So its speed changes by 5/7 b
// g dt / R. Sweeps between friction and that moment end when one changes less than 1e-15 m/s, at an error of
// some ten times as much.
TEST(RollingFriction, SlowsABallByFiveSevenths) {
  const double b = 0.02;
  ContactScene ball = ball_on_ground(b, 0);
  set_motion(ball, Vec3(1, -g * dt, 0), Vec3(0, 0, -2));
  solve(ball, exact);
  const double speed = 1 - 5.0 / 7.0 * b * g * dt / 0.5;
  EXPECT_NEAR(ball.state(0).velocity.x(), speed, 1e-13);
  EXPECT_NEAR(ball.state(0).angular_velocity.z(), -speed / 0.5, 1e-13);
  EXPECT_NEAR(ball.state(0).velocity.y(), 0, 1e-13);
  EXPECT_NEAR(ball.contacts.pairs[0].angular_impulse.norm(), b * 2 * g * dt, 1e-13);
}

// Rolling friction could take 5/7 b g dt / R = 0.0044 m/s: a ball that rolls more slowly stops, and does not
// roll back.
TEST(RollingFriction, StopsAtRestAndNoFarther) {
  ContactScene ball = ball_on_ground(0.02, 0);
  set_motion(ball, Vec3(0.001, -g * dt, 0), Vec3(0, 0, -0.002));
  solve(ball, exact);
  EXPECT_LT(ball.state(0).velocity.norm(), 1e-13);
  EXPECT_LT(ball.state(0).angular_velocity.norm(), 1e-13);
}

// The spin about the normal changes by b m g dt over the inertia 2/5 m R^2, whatever the friction coefficient
// is, and a small spin stops.
TEST(SpinningFriction, SlowsATopByItsLeverArm) {
  const double b = 0.001;
  for (const double friction : {0.0, 0.5}) {
    ContactScene ball = ball_on_ground(0, b, friction);
    set_motion(ball, Vec3(0, -g * dt, 0), Vec3(0, 3, 0));
    solve(ball, exact);
    EXPECT_NEAR(ball.state(0).angular_velocity.y(), 3 - b * g * dt / (0.4 * 0.25), 1e-13);
    EXPECT_LT(ball.state(0).velocity.norm(), 1e-13);
    set_motion(ball, Vec3(0, -g * dt, 0), Vec3(0, 1e-4, 0));
    solve(ball, exact);
    EXPECT_LT(ball.state(0).angular_velocity.norm(), 1e-13);
  }
}

// The moments act about different axes: rolling friction leaves spin about the normal alone, and spinning
// friction leaves rolling alone.
TEST(SpinningFriction, AndRollingFrictionActOnTheirOwnAxes) {
  ContactScene top = ball_on_ground(0.02, 0);
  set_motion(top, Vec3(0, -g * dt, 0), Vec3(0, 3, 0));
  solve(top, exact);
  EXPECT_NEAR(top.state(0).angular_velocity.y(), 3, 1e-15);
  ContactScene roller = ball_on_ground(0, 0.02);
  set_motion(roller, Vec3(1, -g * dt, 0), Vec3(0, 0, -2));
  solve(roller, exact);
  EXPECT_NEAR(roller.state(0).velocity.x(), 1, 1e-13);
}

// Without `angular_friction` the solve ignores both coefficients.
TEST(RollingFriction, NeedsItsEffect) {
  ContactScene ball = ball_on_ground(0.02, 0.02);
  set_motion(ball, Vec3(1, -g * dt, 0), Vec3(0, 1, -2));
  solve(ball, {.iterations = 5000, .tolerance = 1e-15, .angular_friction = false});
  EXPECT_NEAR(ball.state(0).velocity.x(), 1, 1e-13);
  EXPECT_NEAR(ball.state(0).angular_velocity.y(), 1, 1e-15);
}

// Between two free balls that press on each other along x the friction moments are opposite, so that momentum
// and angular momentum stay.
TEST(RollingFriction, KeepsMomentum) {
  scene::Scene scene = test::free_space();
  for (const double side : {-1.0, 1.0}) {
    auto& ball = test::add_ball(scene, side < 0 ? "left" : "right", Vec3(side, 0, 0), 1, 3 + side);
    ball.placement.velocity = Vec3(-side, 0, 0);
    ball.placement.angular_velocity = Vec3(1, 2, 3) * side;
    ball.rolling_friction = ball.spinning_friction = 0.1;
  }
  ContactScene balls(scene, dt);
  const Momentum before = momentum(balls.bodies);
  solve(balls, exact);
  const Momentum after = momentum(balls.bodies);
  EXPECT_GT(balls.contacts.pairs[0].angular_impulse.norm(), 0.1);
  EXPECT_LT((after.linear - before.linear).norm(), 1e-14);
  EXPECT_LT((after.angular - before.angular).norm(), 1e-13);
}

// Returns a box of 1000 kg on one of 1 kg, both with the speed that gravity adds in one step.
scene::Scene heavy_on_light(bool ground) {
  scene::Scene scene = ground ? test::on_ground() : test::free_space();
  scene.gravity = Vec3(0, -g, 0);
  test::add_box(scene, "heavy", Vec3(0, 1.5, 0), Vec3(1, 1, 1), 1000);
  test::add_box(scene, "light", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 1);
  for (auto& box : scene.rigid) box.placement.velocity = Vec3(0, -g * dt, 0);
  return scene;
}

// Returns by how much the worst contact is short of its target, m/s.
double shortfall(const ContactScene& scene) {
  double most = 0;
  for (const ContactPoint& contact : scene.contacts.points)
    most = std::max(most, contact.target - relative_velocity(scene.bodies, contact).dot(contact.normal));
  return most;
}

// Shock propagation brings a heavy box on a light one to rest in one pass, where two sweeps leave more than
// half of the fall.
TEST(ShockPropagation, BringsAHeavyBoxOnALightOneToRestInOnePass) {
  ContactScene tower(heavy_on_light(true), dt);
  build_shock_layers(tower.contacts, tower.graph);
  const ContactSolveSettings brief = {.iterations = 2, .whole_islands = false};
  solve(tower, brief);
  EXPECT_GT(shortfall(tower), 0.5 * g * dt) << "sweeps alone must leave something to do";
  propagate_shocks(tower.bodies, tower.graph, brief, tower.contacts);
  // Each level ends after ten sweeps, or when a sweep changes no velocity by more than 1e-6 m/s. That leaves
  // a ten-thousandth of the fall.
  EXPECT_LT(shortfall(tower), 1e-4 * g * dt);
  for (const std::size_t body : {0u, 1u}) EXPECT_LT(tower.state(body).velocity.norm(), 1e-4 * g * dt);
}

// Without the ground no body is supported: shock propagation leaves the state after the sweeps as it is, to
// the bit.
TEST(ShockPropagation, LeavesBodiesInFreeFlightAlone) {
  scene::Scene scene = heavy_on_light(false);
  scene.rigid[1].placement.velocity = Vec3(0, 2, 0);  // the boxes approach
  ContactScene pair(scene, dt);
  ASSERT_FALSE(pair.contacts.points.empty());
  build_shock_layers(pair.contacts, pair.graph);
  const Momentum before = momentum(pair.bodies);
  solve(pair, {.iterations = 1, .repeats = 1, .whole_islands = false});
  ASSERT_GT(shortfall(pair), 1e-3);
  const RigidState states[] = {pair.state(0), pair.state(1)};
  propagate_shocks(pair.bodies, pair.graph, {}, pair.contacts);
  for (const std::size_t body : {0u, 1u}) {
    EXPECT_EQ(pair.state(body).velocity, states[body].velocity);
    EXPECT_EQ(pair.state(body).angular_momentum, states[body].angular_momentum);
  }
  // The bound is rounding of momenta of 150 N s.
  EXPECT_LT((momentum(pair.bodies).linear - before.linear).norm(), 1e-12);
}

// Two more boxes meet in the air beside a tower: shock propagation acts on the tower alone.
TEST(ShockPropagation, ReachesOnlyWhatIsSupported) {
  scene::Scene scene = heavy_on_light(true);
  test::add_box(scene, "above", Vec3(5, 8, 0), Vec3(1, 1, 1), 2).placement.velocity = Vec3(0, -1, 0);
  test::add_box(scene, "below", Vec3(5, 7, 0), Vec3(1, 1, 1), 1).placement.velocity = Vec3(0, 1, 0);
  ContactScene both(scene, dt);
  build_shock_layers(both.contacts, both.graph);
  ASSERT_FALSE(both.graph.supported[3]);
  solve(both, {.iterations = 1, .repeats = 1, .whole_islands = false});
  const Vec3 above = both.state(2).velocity, below = both.state(3).velocity;
  const Vec3 heavy = both.state(0).velocity;
  propagate_shocks(both.bodies, both.graph, {}, both.contacts);
  EXPECT_EQ(both.state(2).velocity, above);
  EXPECT_EQ(both.state(3).velocity, below);
  EXPECT_NE(both.state(0).velocity, heavy);
}

// Contacts that already separate get no impulse, from sweeps and from shock propagation.
TEST(ContactSolve, LeavesSeparatingBodiesAlone) {
  scene::Scene scene = heavy_on_light(true);
  scene.rigid[0].placement.velocity = Vec3(0, 2, 0);
  scene.rigid[1].placement.velocity = Vec3(0, 1, 0);
  ContactScene rising(scene, dt);
  build_shock_layers(rising.contacts, rising.graph);
  solve(rising, exact);
  propagate_shocks(rising.bodies, rising.graph, exact, rising.contacts);
  EXPECT_EQ(rising.state(0).velocity, Vec3(0, 2, 0));
  EXPECT_EQ(rising.state(1).velocity, Vec3(0, 1, 0));
  EXPECT_EQ(count_active(rising.contacts, rising.graph), 0);
}

// A contact holds an impulse though its ball rises anyway. The solve takes back all of it and no more,
// because contact does not pull.
TEST(ContactSolve, TakesBackWhatWasGivenTooMuchAndNoMore) {
  for (const bool by_shock : {false, true}) {
    ContactScene ball = ball_on_ground(0, 0);
    build_shock_layers(ball.contacts, ball.graph);
    set_motion(ball, Vec3(0, 1, 0), Vec3::Zero());
    find_speculative_targets(dt, OrientationUpdate::exact, ball.graph, ball.bodies, ball.contacts);
    ContactPoint& contact = ball.contacts.points[0];
    contact.impulse = Vec3(0, 4, 0);
    apply_impulse(ball.bodies, contact, contact.impulse);
    ContactSolveScratch scratch;
    if (by_shock)
      propagate_shocks(ball.bodies, ball.graph, exact, ball.contacts);
    else
      solve_contact(ball.bodies, ball.graph, exact, ball.contacts, scratch);
    EXPECT_EQ(contact.impulse, Vec3(0, 0, 0));
    EXPECT_NEAR(ball.state(0).velocity.y(), 1, 1e-15);
  }
}

}  // namespace
}  // namespace duet::contact_solver_test
