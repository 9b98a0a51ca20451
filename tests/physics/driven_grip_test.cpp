// Rigid fingers on prismatic joints, which a bounded force presses onto a rigid cube: they hold what friction
// can hold, however light they are.
#include <algorithm>
#include <cmath>

#include "tests/support/articulated.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::driven_grip_test {
namespace {

constexpr double friction = 0.8, load = 10;  // coefficient; kg, mass of the cube

// Returns a cube of 0.3 m at `place` (m) between two fingers of `mass` (kg), each of which a force of `force`
// (N) presses onto it. They slide on a hand at (0, 0.6, 0).
scene::Scene grip(double mass, double force, const Vec3& place) {
  scene::Scene scene = test::on_ground();
  scene.ground->height = -5;
  scene::RigidBody& hand = test::add_box(scene, "hand", Vec3(0, 0.6, 0), Vec3(0.8, 0.1, 0.3), 1);
  hand.mass.reset();
  hand.is_static = true;
  for (const double side : {-1.0, 1.0}) {
    const std::string name = side < 0 ? "left" : "right";
    test::add_box(scene, name, Vec3(0.2 * side, 0.3, 0), Vec3(0.1, 0.4, 0.3), mass).friction = friction;
    scene::Joint& joint = test::add_joint(scene, scene::JointType::prismatic, "hand", name,
                                          Vec3(0.26 * side, 0.5, 0), Vec3::UnitX());
    joint.has_control = true;
    joint.control.torque_limit = force;
    joint.control.target.travel = -side;
  }
  test::add_box(scene, "cube", place, Vec3::Constant(0.3), load).friction = friction;
  return scene;
}

// Returns by how much the cube has moved (m) after `frames`.
Vec3 slip(const scene::Scene& scene, int frames) {
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < frames; ++frame) simulation.advance_frame();
  return simulation.world().bodies.rigid.state[3].pose.position - scene.rigid[3].placement.position;
}

// A cube that needs 77 and 94 % of the friction stays where it is to 0.01 mm in a second, in the middle of
// the fingers and beside it. The first point of a finger's face that was looked at used to take its whole
// load, because the joint keeps the finger from turning. The cube turned about these points, slipped and
// drifted aside: by 5 m in 2 s, or with fingers of 1 kg by 82 mm.
TEST(DrivenGrip, HoldsWhatFrictionCanHold) {
  for (const double mass : {0.2, 1.0, 10.0})
    for (const double used : {0.77, 0.94})
      for (const Vec3& place : {Vec3(0, 0.3, 0), Vec3(0, 0.32, 0.02)})
        test::expect_below(slip(grip(mass, load * 9.8 / (2 * friction * used), place), 24).norm(), 1e-5,
                           fmt::format("slip with {} kg and {}, m", mass, used));
}

// A cube that needs a quarter more than the friction falls by (1 - 1/1.25) g t^2 / 2 in half a second, to a
// tenth, because it also turns a little.
TEST(DrivenGrip, LetsGoOfWhatFrictionCannotHold) {
  const double fall = (1 - 1 / 1.25) * 9.8 * 0.5 * 0.5 / 2;
  for (const double mass : {1.0, 10.0}) {
    const Vec3 moved = slip(grip(mass, load * 9.8 / (2 * friction * 1.25), Vec3(0, 0.3, 0)), 12);
    test::expect_below(std::abs(-moved.y() / fall - 1), 0.1, fmt::format("fall with {} kg, relative", mass));
  }
}

// The velocities are those of the motion: jaws that hold a light cube still have none. Sweeps that did not
// count the load of a face as a change left 0.07 m/s.
TEST(DrivenGrip, JawsThatHoldStillHaveNoVelocity) {
  scene::Scene scene = grip(1, 60, Vec3(0, 0.25, 0));
  scene.rigid[3].mass = 0.5;
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
  for (std::size_t i = 0; i < 3; ++i)
    test::expect_below(simulation.world().bodies.rigid.state[i + 1].velocity.norm(), 5e-3, "speed, m/s");
}

// A hand that rises by 0.6 m takes the cube along from the ground, to 0.01 mm and without a drift aside.
TEST(DrivenGrip, LiftsACubeFromTheGround) {
  scene::Scene scene = grip(1, 100, Vec3(0, 0.15, 0));
  scene.ground->height = 0;
  scene.rigid[0].is_static = false;
  scene.rigid[0].is_kinematic = true;
  scene.rigid[0].motion.keyframes = {{0.2, Vec3(0, 0.6, 0), {}, false, {}},
                                     {1.1, Vec3(0, 1.2, 0), {}, false, {}}};
  const Vec3 moved = slip(scene, 48);
  test::expect_below(std::abs(moved.y() - 0.6), 1e-5, "slip, m");
  test::expect_below(std::max(std::abs(moved.x()), std::abs(moved.z())), 1e-5, "drift aside, m");
}

}  // namespace
}  // namespace duet::driven_grip_test
