// Control, limits and friction of joints, against theory.
#include <algorithm>
#include <cmath>

#include "tests/support/articulated.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/step/step.h"

namespace duet::joint_control_test {
namespace {

using scene::JointType;

// Returns a hinge in free space between two equal links, controlled to a target angle of one radian with the
// given gain (1/s^2).
scene::Scene actuated(double gain) {
  scene::Scene scene = test::free_space();
  test::add_chain(scene, 2, JointType::hinge, false);
  scene::Joint& joint = scene.joints.back();
  joint.has_control = true;
  joint.control.gain = gain;
  joint.control.target.turn = Vec3(180 / EIGEN_PI, 0, 0);
  return scene;
}

// Returns the angle (rad) of the joint that was added last.
double angle_of_joint(const World& world) {
  const Joint& joint = world.bodies.articulation.joints.back();
  return angle_of(JointFrames(joint, world.bodies.rigid.state[static_cast<std::size_t>(joint.parent)].pose,
                              world.bodies.rigid.state[static_cast<std::size_t>(joint.child)].pose));
}

// The controller is critically damped: the angle is 1 - (1 + w t) exp(-w t) with w^2 equal to the gain. The
// bound of 0.01 rad leaves room for the error of steps of 1/96 s at w = 10/s.
TEST(JointControl, StepResponseIsTheCriticallyDampedCurve) {
  const double gain = 100, omega = std::sqrt(gain);
  Simulation simulation(actuated(gain), test::plan(actuated(gain)));
  World& world = simulation.world();
  double largest = 0;
  for (int i = 0; i < 96; ++i) {
    step(world, i / 96.0, 1 / 96.0);
    const double t = (i + 1) / 96.0;
    const double expected = 1 - (1 + omega * t) * std::exp(-omega * t);
    largest = std::max(largest, std::abs(angle_of_joint(world) - expected));
  }
  test::expect_below(largest, 0.01, "error_rad_of_1");
}

// The control takes the closed-form solution of its equation over each step (Weinstein, Guendelman, Fedkiw
// 2008), so any gain is stable. An explicit control force diverges once gain times dt^2 exceeds some 4.
TEST(JointControl, AnyGainIsStableAndArrives) {
  for (const double gain : {1e1, 1e2, 1e3, 1e4, 1e5, 1e6}) {
    Simulation simulation(actuated(gain), test::plan(actuated(gain)));
    World& world = simulation.world();
    double overshoot = 0, t = 0;
    const double seconds = 30 / std::sqrt(gain) + 1;
    while (t < seconds) {
      const double dt = choose_time_step(world, t);
      step(world, t, dt);
      t += dt;
      overshoot = std::max(overshoot, angle_of_joint(world) - 1);
    }
    test::expect_below(std::abs(angle_of_joint(world) - 1), 1e-9,
                       fmt::format("error_at_the_end_{:.0e}", gain));
    test::expect_below(overshoot, 0.01, fmt::format("overshoot_{:.0e}", gain));
    // The torques on the two links are equal and opposite.
    test::expect_below(momentum(world.bodies).angular.norm(), 1e-10, "angular_momentum");
    test::expect_below(momentum(world.bodies).linear.norm(), 1e-11, "linear_momentum");
  }
}

// The control sets the rate of a joint, whatever torque that takes, so a joint under load rests at its target
// and not at load / stiffness beside it.
TEST(JointControl, HoldsALoadWithoutSagging) {
  scene::Scene scene;
  test::add_chain(scene, 3, JointType::hinge, true, 100);
  for (scene::Joint& joint : scene.joints) {
    joint.has_control = true;
    joint.control.gain = 400;
  }
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 480; ++i) step(world, i / 96.0, 1 / 96.0);
  test::expect_below(std::abs(angle_of_joint(world)), 1e-6, "angle_of_the_last_joint");
  test::expect_below(std::abs(world.bodies.rigid.state.back().pose.position.y()), 1e-6, "sagging_m");
}

// A limit on the torque bounds the change of angular momentum: |L| <= 2 N m t. The control must use at least
// half of it here, because its gain asks for more.
TEST(JointControl, TorqueStaysWithinItsLimit) {
  scene::Scene scene = actuated(1e4);
  scene.joints.back().control.torque_limit = 2;
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  // By symmetry the two links turn about the hinge as one of them would about a fixed hinge, with half of the
  // angle.
  const double inertia = 10 * (1 + 0.01) / 12;
  for (int i = 0; i < 48; ++i) step(world, i / 96.0, 1 / 96.0);
  // The torque of at most 2 N m changes the angular momentum by at most 2 N m times 0.5 s.
  const double angular = inertia * world.bodies.rigid.state[1].angular_velocity.z();
  test::expect_below(angular, 2 * 0.5 * (1 + 1e-9), "angular_momentum_after_half_a_second");
  test::expect_above(angular, 0.5, "angular_momentum_after_half_a_second");
}

// Returns a flywheel on a hinge, which follows a target of 10 turns a second.
scene::Scene flywheel(double torque_limit) {
  scene::Scene scene = test::free_space();
  test::add_peg(scene, "base", Vec3::Zero());
  test::add_ball(scene, "wheel", Vec3(0, 0, 1), 0.5, 10);
  scene::Joint& joint =
      test::add_joint(scene, JointType::hinge, "base", "wheel", Vec3(0, 0, 1), Vec3::UnitZ());
  joint.has_control = true;
  joint.control.gain = 400;
  joint.control.torque_limit = torque_limit;
  joint.control.target.turn_rate = Vec3(3600, 0, 0);
  return scene;
}

// A motor whose torque is bounded lags behind a fast target by turns, and accelerates all the while. Its
// error was once taken modulo a turn, so that it pulled backward after the first half one.
TEST(JointControl, AMotorThatLagsByTurnsKeepsItsDirection) {
  constexpr double torque = 5, inertia = 0.4 * 10 * 0.5 * 0.5;  // N m; kg m^2
  const scene::Scene scene = flywheel(torque);
  Simulation simulation(scene, test::plan(scene));
  const World& world = simulation.world();
  simulation.advance_frame();  // the torque grows to its bound
  double before = world.bodies.rigid.state[1].angular_velocity.z();
  for (int frame = 2; frame <= 48; ++frame) {
    simulation.advance_frame();
    const double rate = world.bodies.rigid.state[1].angular_velocity.z();
    ASSERT_NEAR(rate - before, torque / inertia / 24, 1e-9) << "frame " << frame;
    before = rate;
  }
}

// Without a bound, a joint that is slower than its target for seconds catches up with it turn by turn: it
// lags by 2 / sqrt(gain) s in the end. With a gain of 0 the motor takes on the speed of its target, and stays
// there.
TEST(JointControl, MotorsReachTheAngleOrTheSpeedOfTheirTarget) {
  constexpr double speed = 20 * EIGEN_PI;  // rad/s
  scene::Scene scene = flywheel(100);
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 192; ++frame) simulation.advance_frame();
  // The target stands still within a step, so that the rate falls a little until its end.
  test::expect_below(std::abs(simulation.world().bodies.rigid.state[1].angular_velocity.z() / speed - 1),
                     1e-3, "error of the speed with a gain, relative");
  const double lag =
      8 - simulation.world().last_step.control_angle.back() / speed;  // s, at the last step's start
  EXPECT_GT(lag, 0.1);
  EXPECT_LT(lag, 0.1 + 1.0 / 24);
  scene.joints.back().control = {};
  scene.joints.back().control.gain = 0;
  scene.joints.back().control.damping = 20;
  scene.joints.back().control.lead = true;
  scene.joints.back().control.torque_limit = 100;
  scene.joints.back().control.target = flywheel(1).joints.back().control.target;
  Simulation motor(scene, test::plan(scene));
  double fastest = 0;
  for (int frame = 0; frame < 48; ++frame) {
    motor.advance_frame();
    fastest = std::max(fastest, motor.world().bodies.rigid.state[1].angular_velocity.z());
  }
  test::expect_below(std::abs(motor.world().bodies.rigid.state[1].angular_velocity.z() / speed - 1), 1e-6,
                     "error of the speed of a motor, relative");
  test::expect_below(fastest / speed - 1, 1e-6, "overshoot of a motor, relative");
}

// A motor without gain turns or pushes at its speed to the limit of its joint, against gravity, and stays
// there, with and without a bound of its force. It used to stop where its target had passed the limit, 6 of
// 40 degrees before.
TEST(JointControl, MotorsWithoutGainReachTheLimitOfTheirJoint) {
  for (const JointType type : {JointType::hinge, JointType::prismatic})
    for (const double most : {120.0, 1e9}) {
      scene::Scene scene = test::on_ground();
      scene.ground->height = -10;
      test::add_peg(scene, "peg", Vec3::Zero());
      test::add_box(scene, "arm", Vec3(0.5, 0, 0), Vec3(1, 0.1, 0.1), 5);
      const bool turns = type == JointType::hinge;
      scene::Joint& joint =
          test::add_joint(scene, type, "peg", "arm", Vec3::Zero(), turns ? Vec3::UnitZ() : Vec3::UnitY());
      joint.angle = {.least = -10, .most = 40};
      joint.travel = {.least = -0.1, .most = 0.7};
      joint.has_control = true;
      joint.control = {.gain = 0, .damping = 20, .torque_limit = most, .lead = true, .target = {}};
      joint.control.target.turn_rate.x() = 180;
      joint.control.target.travel_rate = 3;
      Simulation simulation(scene, test::plan(scene));
      for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
      const RigidState& arm = simulation.world().bodies.rigid.state[1];
      const Vec3& place = arm.pose.position;
      const double reached = turns ? std::atan2(place.y(), place.x()) * 180 / EIGEN_PI / 40 : place.y() / 0.7;
      test::expect_below(std::abs(reached - 1), 1e-9, "distance from the limit, over its place");
      test::expect_below(arm.velocity.norm(), 1e-9, "speed at the limit, m/s");
    }
}

// A rod that falls onto the limit of its hinge stops there without bouncing or drifting, and leaves it freely
// when gravity is reversed. A limit that pulls as well as pushes would hold the rod.
TEST(JointLimits, StopAHingeAndLetItGo) {
  scene::Scene scene;
  test::add_chain(scene, 1, JointType::hinge, true);
  scene.joints.back().angle.least = -30;
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  double least = 0;
  for (int i = 0; i < 192; ++i) {
    step(world, i / 96.0, 1 / 96.0);
    least = std::min(least, angle_of_joint(world));
  }
  test::expect_above(least, -30 * EIGEN_PI / 180 - 1e-6, "least_angle");
  test::expect_below(std::abs(angle_of_joint(world) + 30 * EIGEN_PI / 180), 1e-6, "rests_at_the_limit");
  world.gravity *= -1;
  for (int i = 0; i < 20; ++i) step(world, 2 + i / 96.0, 1 / 96.0);
  test::expect_above(angle_of_joint(world), -0.5, "angle_after_being_let_go");
}

// Friction of 4 N m brakes a wheel with I = 2 kg m^2 by 2 rad/s^2: from 5 to 3 rad/s after 1 s, and to rest,
// without turning back, before 3 s.
TEST(JointFriction, StopsASpinLikeABrake) {
  scene::Scene scene;
  scene.gravity.setZero();
  test::add_peg(scene, "peg", Vec3::Zero());
  test::add_box(scene, "wheel", Vec3(0, 0, 0.2), Vec3(1, 1, 0.1), 12);
  scene.rigid.back().placement.angular_velocity = Vec3(0, 0, 5);
  test::add_joint(scene, JointType::hinge, "peg", "wheel", Vec3(0, 0, 0.2), Vec3::UnitZ());
  scene.joints.back().friction = 4;  // N m; I = 2 kg m^2, hence 2 rad/s^2
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 96; ++i) step(world, i / 96.0, 1 / 96.0);
  test::expect_below(std::abs(world.bodies.rigid.state[1].angular_velocity.z() - 3), 1e-6, "after_1_s");
  for (int i = 0; i < 192; ++i) step(world, 1 + i / 96.0, 1 / 96.0);
  test::expect_below(std::abs(world.bodies.rigid.state[1].angular_velocity.z()), 1e-9, "after_3_s");
}

}  // namespace
}  // namespace duet::joint_control_test
