// Control of universal joints of which one angle is free.
#include "sim/articulation/joint_control.h"

#include <cmath>
#include <random>

#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/base/rotation.h"
#include "sim/step/step.h"

namespace duet::joint_control_test {
namespace {

// Returns a universal joint of whose angles `axis` (0 or 1) is controlled towards `target` (rad).
Joint universal(int axis, double target) {
  Joint joint;
  joint.kind = JointKind::universal;
  joint.control.on = true;
  joint.control.gain = 100;
  joint.control.damping = 20;
  joint.control.axis = {axis == 0, axis == 1, true};
  joint.control.target.constant = target * Vec3::Unit(axis);
  return joint;
}

// The rate that is asked for about the controlled axis follows the control equation, whatever the other angle
// and its rate are.
TEST(JointControl, OfOneAngleIgnoresTheFreeOne) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-1, 1);
  double worst = 0;
  for (int i = 0; i < 200; ++i) {
    const int axis = i % 2;
    const double target = number(random), angles[] = {3 * number(random), 3 * number(random)},
                 rates[] = {10 * number(random), 10 * number(random)};
    const Joint joint = universal(axis, target);
    const Quat turn = exponential(Vec3(angles[0], 0, 0)) * exponential(Vec3(0, angles[1], 0));
    const JointFrames frames(joint, Pose(), {Vec3::Zero(), turn});
    const Vec3 y = turn * Vec3::UnitY(), rate = rates[0] * Vec3::UnitX() + rates[1] * y;
    const double dt = 0.01, error = std::remainder(target - angles[axis], 2 * EIGEN_PI);
    const ControlError after = controlled_error({error, -rates[axis]}, 100, 20, dt);
    double angle = 0;
    const ControlRates asked = control_rates(joint, frames, rate, 0, dt, angle);
    const Vec3 along = axis == 0 ? Vec3(Vec3::UnitX()) : y;
    const Vec3 along_end = axis == 0 ? along : Vec3(exponential(Vec3(dt * rates[0], 0, 0)) * y);
    worst = std::max(worst, std::abs(asked.mean.dot(along) - (error - after.value) / dt));
    worst = std::max(worst, std::abs(asked.end.dot(along_end) + after.rate));
  }
  test::expect_below(worst, 1e-11, "error of the rate, rad/s");
}

// One angle of a box on a static body follows its target in closed form while the box spins about the other
// axis.
TEST(JointControl, OfOneAngleFollowsItsTargetWhileTheOtherTurns) {
  for (const int axis : {0, 1}) {
    scene::Scene scene = test::free_space();
    test::add_box(scene, "base", Vec3::Zero(), Vec3(0.1, 0.1, 0.1), 1).is_static = true;
    scene.rigid.back().mass.reset();
    test::add_box(scene, "box", Vec3::Zero(), Vec3(0.3, 0.2, 0.1), 1).placement.angular_velocity =
        axis == 0 ? Vec3(0, 4, 0) : Vec3(4, 0, 0);
    scene::Joint& joint = scene.joints.emplace_back();
    joint.name = "joint";
    joint.type = scene::JointType::universal;
    joint.parent = "base";
    joint.child = "box";
    joint.world.position = Vec3::Zero();
    joint.world.up = Vec3::UnitY();
    joint.has_control = true;
    joint.control.gain = 100;
    (axis == 0 ? joint.control.y : joint.control.x) = false;
    joint.control.target.turn = 30 * Vec3::Unit(axis);
    Simulation simulation(scene, test::plan(scene));
    World& world = simulation.world();
    const double dt = 5e-3, target = EIGEN_PI / 6;
    double worst = 0, turned = 0;
    for (int i = 0; i < 100; ++i) {
      step(world, i * dt, dt);
      const Mat3 r = world.bodies.rigid.state[1].pose.orientation.toRotationMatrix();
      const double about_x = std::atan2(r(2, 1), r(1, 1)), about_y = std::atan2(r(0, 2), r(0, 0));
      const double angle = axis == 0 ? about_x : about_y;
      turned = std::max(turned, std::abs(axis == 0 ? about_y : about_x));
      const double left = controlled_error({target, 0}, 100, 20, (i + 1) * dt).value;
      worst = std::max(worst, std::abs(target - angle - left));
    }
    test::expect_above(turned, 1, "free angle, rad");
    test::expect_below(worst, 5e-3, "error of the controlled angle, rad");
  }
}

}  // namespace
}  // namespace duet::joint_control_test
