// Elastic impacts between jointed bodies lose no energy, because an impact moves all that the joints connect:
// Newton's cradle, balls that strike doors, and balls that strike chains.
#include <algorithm>
#include <cmath>

#include "tests/support/articulated.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/step/step.h"

namespace duet::everyday_rigid_cradle_test {
namespace {

using scene::JointType;

double energy(const World& world) {  // J
  return kinetic_energy(world.bodies) + gravitational_energy(world.bodies, world.gravity);
}

// A Newton's cradle.
struct Cradle {
  int balls = 5, lifted = 1;
  JointType joint = JointType::point;
  double length = 1;                           // m, from a joint to its ball's center
  double gap = 0;                              // m, between balls at rest
  double step = 0;                             // s; 0: the program's choice
  double angle = 30 * double{EIGEN_PI} / 180;  // of the lifted balls
};

constexpr double radius = 0.1;  // m

// Builds the cradle at rest, its first balls lifted.
scene::Scene build(const Cradle& cradle) {
  scene::Scene scene;
  scene.title = "cradle";
  if (cradle.step > 0) scene.solver.max_time_step = cradle.step;
  test::add_peg(scene, "bar", Vec3(0, 3, 0));
  for (int i = 0; i < cradle.balls; ++i) {
    const double x = i * (2 * radius + cradle.gap), turn = i < cradle.lifted ? -cradle.angle : 0;
    const std::string name = fmt::format("ball{}", i);
    const Vec3 center(x + cradle.length * std::sin(turn), -cradle.length * std::cos(turn), 0);
    scene::RigidBody& ball = test::add_ball(scene, name, center, radius, 1);
    ball.restitution = 1;
    ball.friction = 0;
    test::add_joint(scene, cradle.joint, "bar", name, Vec3(x, 0, 0), Vec3::UnitZ());
  }
  return scene;
}

// Returns the largest change of the energy within five seconds, over the energy of the lifted balls.
double change_of_energy(const Cradle& cradle) {
  const scene::Scene scene = build(cradle);
  Simulation simulation(scene, test::plan(scene));
  const World& world = simulation.world();
  const double start = energy(world),
               lifted = cradle.lifted * 9.8 * cradle.length * (1 - std::cos(cradle.angle));
  double change = 0;
  for (int frame = 0; frame < 5 * 24; ++frame) {
    simulation.advance_frame();
    change = std::max(change, std::abs(energy(world) - start) / lifted);
  }
  return change;
}

// Bound of the relative change of energy. An impulse on a ball by itself, which its joint corrects
// afterwards, would take 2/5 (radius / length)^2 of its energy: 0.4 % at a length of 1 m and ten times that
// at 0.3 m, for each impact. What remains is the error of the joints at the turns of a step.
constexpr double most = 1e-3;

// The bound holds for any number of balls and of lifted balls. Treating jointed balls as free ones in an
// impact loses energy with every impact.
TEST(EverydayRigidCradle, KeepsItsEnergyWhateverItsCounts) {
  for (const auto& [balls, lifted] : {std::pair(2, 1), {3, 1}, {4, 2}, {5, 1}, {5, 2}, {7, 3}, {9, 1}})
    test::expect_below(change_of_energy({.balls = balls, .lifted = lifted}), most,
                       fmt::format("{}_balls_{}_lifted", balls, lifted));
}

// Other joints, lengths and steps, and gaps between the balls, have the same bound.
TEST(EverydayRigidCradle, KeepsEnergyForAllJointsLengthsAndSteps) {
  for (const JointType joint : {JointType::hinge, JointType::universal})
    test::expect_below(change_of_energy({.joint = joint}), most,
                       joint == JointType::hinge ? "hinges" : "universal_joints");
  for (const double length : {0.3, 3.0})
    test::expect_below(change_of_energy({.length = length}), most, fmt::format("length_{}", length));
  for (const double step : {5e-3, 1e-3})
    test::expect_below(change_of_energy({.step = step}), most, fmt::format("step_{}", step));
  for (const double gap : {1e-4, 1e-2})
    test::expect_below(change_of_energy({.gap = gap}), most, fmt::format("gap_{}", gap));
}

// The inner balls of a cradle with one lifted ball never move, because every blow passes through them in no
// time. Returns how far one of them is from its place at most, over the radius, at the frames of five
// seconds.
double motion_of_inner_balls(const Cradle& cradle) {
  const scene::Scene scene = build(cradle);
  Simulation simulation(scene, test::plan(scene));
  const auto place = [&](int ball) {
    return simulation.world().bodies.rigid.state[as_index(ball) + 1].pose.position;
  };
  double motion = 0;
  for (int frame = 0; frame < 5 * 24; ++frame) {
    simulation.advance_frame();
    for (int i = 1; i + 1 < cradle.balls; ++i)
      motion = std::max(motion, (place(i) - Vec3(i * 2 * radius, -cradle.length, 0)).norm() / radius);
  }
  return motion;
}

// Blows pass through the inner balls, whatever the length and the height, because they act when balls meet. A
// blow that acts at the beginning of its step leaves the ball where it is then, up to 3 cm too early, and the
// balls swing against each other ever more.
TEST(EverydayRigidCradle, InnerBallsStayWhereTheyHang) {
  for (const double length : {0.3, 1.0, 3.0})
    for (const double degrees : {5.0, 20.0, 40.0, 80.0})
      test::expect_below(motion_of_inner_balls({.length = length, .angle = degrees * double{EIGEN_PI} / 180}),
                         1e-3, fmt::format("length_{}_from_{}_degrees", length, degrees));
}

// Returns the ratio of the last to the first energy of a scene without gravity in which a ball of 1 kg flies
// from `from` at 3 m/s into jointed bodies.
double kept(scene::Scene scene, const Vec3& from, double restitution) {
  scene::RigidBody& ball = test::add_ball(scene, "ball", from, 0.1, 1);
  ball.placement.velocity = Vec3(0, 0, -3);
  for (scene::RigidBody& body : scene.rigid) {
    body.restitution = restitution;
    body.friction = 0;
  }
  Simulation simulation(scene, test::plan(scene));
  const World& world = simulation.world();
  const double start = energy(world);
  for (int frame = 0; frame < 12; ++frame) simulation.advance_frame();
  EXPECT_NE(world.bodies.rigid.state.back().velocity, Vec3(0, 0, -3)) << "it has struck";
  return energy(world) / start;
}

// A door that is hinged at its edge has the effective mass M = I / x^2 at the distance x from the hinge. An
// impact with the restitution e takes (1 - e^2) (m M) / (m + M) v^2 / 2. A door that answered as a free body
// would have another effective mass.
TEST(EverydayRigidCradle, DoorsAreStruckWithTheirRestitution) {
  for (const double e : {0.0, 0.5, 1.0})
    for (const double x : {0.3, 0.5, 0.8}) {
      scene::Scene scene = test::free_space();
      test::add_peg(scene, "post", Vec3(-0.1, 0, 0));
      const double mass = 4, width = 1, thickness = 0.05;
      test::add_box(scene, "door", Vec3(0.5, 0, 0), Vec3(width, 2, thickness), mass);
      test::add_joint(scene, JointType::hinge, "post", "door", Vec3::Zero(), Vec3::UnitY());
      const double inertia = mass * ((width * width + thickness * thickness) / 12 + 0.25);
      const double there = inertia / (x * x);
      const double theory = 1 - (1 - e * e) * there / (1 + there);
      test::expect_below(std::abs(kept(scene, Vec3(x, 0, 0.5), e) - theory), 2e-3,
                         fmt::format("restitution_{}_at_{}", e, x));
    }
}

// Elastic impacts on free chains keep the energy, whatever the joints and wherever they strike.
TEST(EverydayRigidCradle, FreeChainsAreStruckElastically) {
  for (const JointType joint : {JointType::point, JointType::hinge, JointType::weld})
    for (const double x : {0.2, 1.5, 2.9}) {
      scene::Scene scene = test::free_space();
      test::add_chain(scene, 3, joint, false);
      test::expect_below(std::abs(kept(scene, Vec3(x, 0, 0.5), 1) - 1), 2e-3, fmt::format("chain_at_{}", x));
    }
}

}  // namespace
}  // namespace duet::everyday_rigid_cradle_test
