#include "sim/rigid/kinematic_motion.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/base/rotation.h"

namespace duet::kinematic_motion_test {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();
const Interpolation smooth = Interpolation::smooth, linear = Interpolation::linear;

// Returns a motion that stays at the origin.
KinematicMotion at_rest() {
  KinematicMotion motion;
  motion.position = {.time = {0}, .value = {Vec3::Zero()}, .increment = {}};
  motion.orientation = {.time = {0}, .value = {Quat::Identity()}, .increment = {}};
  return motion;
}

// Returns a motion with a position track through the keys.
KinematicMotion through(const std::vector<PositionKey>& keys, Interpolation interpolation = smooth,
                        AfterLastKey after = AfterLastKey::stay) {
  KinematicMotion motion = at_rest();
  motion.position = position_track(keys, interpolation, after);
  return motion;
}

// Returns a motion with an orientation track through the keys.
KinematicMotion turning(const std::vector<OrientationKey>& keys, Interpolation interpolation = smooth,
                        AfterLastKey after = AfterLastKey::stay) {
  KinematicMotion motion = at_rest();
  motion.orientation = orientation_track(keys, interpolation, after);
  return motion;
}

// Returns a motion with all kinds of tracks at once, for a body whose center of mass is not the origin of its
// shape's coordinates.
KinematicMotion everything() {
  KinematicMotion motion = through(
      {{0, Vec3(1, 2, 3)}, {0.7, Vec3(2, 2, 1)}, {2, Vec3(2, -1, 4), Vec3(1, 0, -2)}, {2.5, Vec3(3, 0, 3)}});
  motion.orientation = orientation_track(std::vector<OrientationKey>{{0.2, Vec3::UnitX(), 0.5},
                                                                     {1, Vec3(1, 2, 2) / 3, 2},
                                                                     {1.4, Vec3(1, 2, 2) / 3, 9},
                                                                     {2.6, Vec3::UnitZ(), -1}},
                                         smooth, AfterLastKey::stay);
  motion.spins = {{Vec3(0, 0.6, 0.8), 3, 0.3, 2.2, 0.4}, {Vec3::UnitX(), -1, -5}};
  motion.sinusoids = {{Vec3(0.2, 0.1, -0.3), Vec3(0.3, 0, 0.4), 1.7, 0.8, -1},
                      {Vec3(0, 0.5, 0), Vec3::Zero(), 0.6, -pi / 2, 0.4, 2.1}};
  motion.frame.position = Vec3(0.4, -0.2, 0.1);
  motion.frame.orientation = exponential(Vec3(0.3, 0.9, -0.4));
  return motion;
}

// Expects that the velocities are the derivatives of the pose, by central differences.
void expect_velocities_are_derivatives(const KinematicMotion& motion, double time) {
  SCOPED_TRACE(time);
  constexpr double h = 1e-5;
  const MotionState before = motion_at(motion, time - h), now = motion_at(motion, time),
                    after = motion_at(motion, time + h);
  const Vec3 velocity = (after.pose.position - before.pose.position) / (2 * h);
  const Vec3 spin = logarithm(after.pose.orientation * before.pose.orientation.conjugate()) / (2 * h);
  // The bounds are h^2 / 6 times third derivatives of some 1e3, and rounding of 1e-16 / h, with a margin.
  EXPECT_LT((velocity - now.velocity).norm(), 2e-7);
  EXPECT_LT((spin - now.angular_velocity).norm(), 2e-7);
  EXPECT_NEAR(now.pose.orientation.norm(), 1, 1e-15);
}

// log(exp(v)) = v for angles below pi, tiny ones included; both signs of a quaternion give the same rotation,
// and the result is the rotation of less than half a turn.
TEST(Rotation, LogarithmUndoesTheExponential) {
  for (const Vec3& v : {Vec3(0, 0, 0), Vec3(1e-9, 0, 2e-9), Vec3(0.3, -0.2, 0.1), Vec3(0, 3.14159, 0)})
    EXPECT_LT((logarithm(exponential(v)) - v).norm(), 1e-15 * (1 + v.norm()));
  const Quat q = exponential(Vec3(0.3, -0.2, 0.1));
  EXPECT_LT((logarithm(Quat(-q.coeffs())) - Vec3(0.3, -0.2, 0.1)).norm(), 1e-15) << "the same rotation";
  EXPECT_LT((logarithm(exponential(Vec3(0, 4, 0))) - Vec3(0, 4 - 2 * pi, 0)).norm(), 1e-15)
      << "the short way";
}

// The law holds at times before, between and after all keys, starts and stops; none of the times is at one of
// them.
TEST(KinematicMotion, VelocitiesAreTheDerivativesOfThePose) {
  const KinematicMotion motion = everything();
  for (int i = -10; i < 290; ++i) expect_velocities_are_derivatives(motion, 0.01 * i + 0.0037);
}

// Smooth tracks are C1: the velocity does not jump at keys, starts and stops, where a jump would be an impact
// for the bodies that touch it.
TEST(KinematicMotion, VelocitiesAreContinuousInTime) {
  const KinematicMotion motion = everything();
  for (double time : {0.0, 0.2, 0.3, 0.7, 1.0, 1.4, 1.8, 2.0, 2.2, 2.5, 2.6, 0.4}) {
    const MotionState before = motion_at(motion, time - 1e-9), after = motion_at(motion, time + 1e-9);
    EXPECT_LT((after.velocity - before.velocity).norm(), 1e-6) << time;
    EXPECT_LT((after.angular_velocity - before.angular_velocity).norm(), 1e-6) << time;
  }
}

// The velocity jumps at every time that next_jump() names, and nowhere else.
TEST(KinematicMotion, NextJumpFindsEveryJumpOfTheVelocity) {
  KinematicMotion motion =
      through({{0.1, Vec3(0, 0, 0)}, {0.3, Vec3(1, 0, 0)}, {0.4, Vec3(1.5, 0, 0)}, {0.7, Vec3(0, 0, 0)}},
              linear);  // 0.3 s is no jump
  EXPECT_EQ(next_jump(motion, 0), 0.1);
  EXPECT_EQ(next_jump(motion, 0.1), 0.4);
  EXPECT_EQ(next_jump(motion, 0.4), 0.7);
  EXPECT_EQ(next_jump(motion, 0.7), infinity);
  motion.position.loop = true;
  find_jumps(motion.position);
  for (double lap : {-2.0, 0.0, 1.0, 1000.0}) {
    EXPECT_NEAR(next_jump(motion, 0.6 * lap + 0.11), 0.6 * lap + 0.4, 1e-12);
    EXPECT_NEAR(next_jump(motion, 0.6 * lap + 0.41), 0.6 * lap + 0.7, 1e-12);
  }
  EXPECT_EQ(next_jump(everything(), -1), 2.1) << "the stop of a sinusoid alone";
  EXPECT_EQ(next_jump(everything(), 2.1), infinity);

  motion = at_rest();
  motion.spins = {{Vec3::UnitX(), 3, 0.5, 2, 0}, {Vec3::UnitY(), 3, 0.7, 2.5, 0.2}};
  motion.sinusoids = {{Vec3(1, 0, 0), Vec3::Zero(), 2, 0, 1.2, 1.9},
                      {Vec3(1, 0, 0), Vec3::Zero(), 2, pi / 2, 1.4}};
  std::vector<double> jumps;
  for (double time = next_jump(motion, 0); time < infinity; time = next_jump(motion, time))
    jumps.push_back(time);
  EXPECT_EQ(jumps, (std::vector<double>{0.5, 1.2, 1.9, 2}));
  for (const double jump : jumps) {
    const MotionState before = motion_at(motion, jump - 1e-9), after = motion_at(motion, jump + 1e-9);
    EXPECT_GT(
        (after.velocity - before.velocity).norm() + (after.angular_velocity - before.angular_velocity).norm(),
        1);
  }
}

// Before the first key and from the last one on the body rests at that key's position.
TEST(KinematicMotion, PassesThroughItsKeysAndRestsOutsideOfThem) {
  const std::vector<PositionKey> keys = {{1, Vec3(1, 0, 2)}, {2, Vec3(3, -1, 0)}, {2.5, Vec3(3, 4, 1)}};
  for (const Interpolation interpolation : {smooth, linear}) {
    const KinematicMotion motion = through(keys, interpolation);
    for (const PositionKey& key : keys)
      EXPECT_LT((motion_at(motion, key.time).pose.position - key.position).norm(), 1e-15);
    for (double time : {-3.0, 0.999, 2.5, 70.0}) {
      EXPECT_EQ(motion_at(motion, time).pose.position, keys[time < 1 ? 0 : 2].position);
      EXPECT_TRUE(motion_at(motion, time).velocity.isZero(0));
    }
  }
}

// A smooth track is monotonic in a coordinate whose keys are, and stays at a position that two keys share: an
// overshoot would push a body through its neighbor.
TEST(KinematicMotion, SmoothTracksEndAtRestWithoutOvershoot) {
  const KinematicMotion motion =
      through({{0, Vec3(0, 0, 0)}, {1, Vec3(5, 0, -1)}, {2, Vec3(5, 0, -1)}, {2.2, Vec3(6, -3, 8)}});
  EXPECT_TRUE(motion_at(motion, 0).velocity.isZero(0));
  EXPECT_LT(motion_at(motion, 2.2 - 1e-9).velocity.norm(), 1e-5);
  Vec3 last = motion_at(motion, 0).pose.position;
  for (double time = 0; time <= 2.2; time += 0.01) {
    const Vec3 now = motion_at(motion, time).pose.position;
    EXPECT_GE(now.x(), last.x() - 1e-14) << time;  // from 0 to 5, then held, then to 6
    if (time >= 1 && time <= 2) {
      EXPECT_LT((now - Vec3(5, 0, -1)).norm(), 1e-15);
    }
    last = now;
  }
}

// The velocity is constant between keys, and at a key it is that of the part that follows.
TEST(KinematicMotion, LinearTracksHaveConstantVelocity) {
  const KinematicMotion motion =
      through({{0, Vec3(0, 0, 0)}, {2, Vec3(4, 0, 0)}, {3, Vec3(4, 5, 0)}}, linear);
  for (double time : {0.0, 0.3, 1.9})
    EXPECT_TRUE(motion_at(motion, time).velocity.isApprox(Vec3(2, 0, 0), 1e-14)) << time;
  EXPECT_TRUE(motion_at(motion, 2).velocity.isApprox(Vec3(0, 5, 0), 1e-14)) << "from then on";
  EXPECT_TRUE(motion_at(motion, 0.3).pose.position.isApprox(Vec3(0.6, 0, 0), 1e-14));
}

// The analytic body of the scene of figure 8: a cubic between two keys with velocities is a parabola, so the
// acceleration is constant, to rounding.
TEST(KinematicMotion, VelocitiesAtKeysMakeAParabola) {
  const Vec3 a(-1.4, -0.5, 0);
  const KinematicMotion motion = through({{0, Vec3::Zero(), Vec3::Zero()}, {4, 8 * a, 4 * a}});
  for (double time = 0; time < 4; time += 0.13) {
    EXPECT_LT((motion_at(motion, time).pose.position - time * time / 2 * a).norm(), 1e-14);
    EXPECT_LT((motion_at(motion, time).velocity - time * a).norm(), 1e-14);
  }
}

// The twisting chain of figure 1: keys about one axis turn by 5.75 turns in 23 s, hold for 1 s, and unwind.
// An angle of -11.5 pi about the opposite axis is the same rotation as 11.5 pi, so that nothing turns between
// the two.
TEST(KinematicMotion, KeysWithOneAxisTurnAsOftenAsTheirAnglesSay) {
  const std::vector<OrientationKey> keys = {{2, Vec3::UnitX(), 0},
                                            {25, Vec3::UnitX(), 11.5 * pi},
                                            {26, -Vec3::UnitX(), -11.5 * pi},
                                            {49, Vec3::UnitY(), 0}};
  const KinematicMotion motion = turning(keys, linear);
  for (double time : {2.0, 2.7, 10.1, 24.9}) {
    const MotionState state = motion_at(motion, time);
    EXPECT_LT((state.angular_velocity - Vec3(pi / 2, 0, 0)).norm(), 1e-13) << time;
    EXPECT_LT(state.pose.orientation.angularDistance(exponential(Vec3(pi / 2 * (time - 2), 0, 0))), 1e-13);
  }
  EXPECT_LT(motion_at(motion, 25.5).angular_velocity.norm(), 1e-13);
  EXPECT_LT((motion_at(motion, 30).angular_velocity + Vec3(pi / 2, 0, 0)).norm(), 1e-13);
  // A smooth track makes the same turns in the same time.
  double angle = 0;
  const KinematicMotion gentle = turning(keys);
  for (double time = 2; time < 25; time += 0.01) {
    EXPECT_GE(motion_at(gentle, time).angular_velocity.x(), 0);
    angle += 0.01 * motion_at(gentle, time + 0.005).angular_velocity.x();
  }
  EXPECT_NEAR(angle, 11.5 * pi, 1e-4);  // error of the midpoint rule
}

// Between keys about different axes the rotation is the shortest one, at constant rate (spherical
// interpolation).
TEST(KinematicMotion, KeysWithTwoAxesTakeTheShortestRotation) {
  const KinematicMotion motion =
      turning({{0, Vec3::UnitX(), 3 * pi / 2}, {1, Vec3::UnitY(), 5 * pi / 2}}, linear);
  const Quat from = exponential(Vec3(-pi / 2, 0, 0)), to = exponential(Vec3(0, pi / 2, 0));
  EXPECT_LT(motion_at(motion, 0.3).pose.orientation.angularDistance(from.slerp(0.3, to)), 1e-14);
  EXPECT_NEAR(motion_at(motion, 0.3).angular_velocity.norm(), from.angularDistance(to), 1e-14);
}

// A loop repeats with its period, and position, velocity and rate are continuous where it begins again.
TEST(KinematicMotion, LoopsRepeatWithoutAJolt) {
  KinematicMotion motion =
      through({{1, Vec3(0, 0, 0)}, {2, Vec3(2, 1, 0)}, {4, Vec3(0, 0, 0)}}, smooth, AfterLastKey::repeat);
  motion.orientation =
      orientation_track(std::vector<OrientationKey>{{1, Vec3::UnitY(), 0}, {4, Vec3::UnitY(), 2 * pi}},
                        smooth, AfterLastKey::repeat);
  for (double time : {-0.5, 1.3, 3.9}) {
    const MotionState once = motion_at(motion, time), again = motion_at(motion, time + 9);
    EXPECT_LT((once.pose.position - again.pose.position).norm(), 1e-14);
    EXPECT_LT((once.velocity - again.velocity).norm(), 1e-14);
    EXPECT_LT((again.angular_velocity - Vec3(0, 2 * pi / 3, 0)).norm(), 1e-14) << "steady, end to beginning";
    expect_velocities_are_derivatives(motion, time);
  }
  EXPECT_LT((motion_at(motion, 4 - 1e-9).velocity - motion_at(motion, 4 + 1e-9).velocity).norm(), 1e-7);
}

// The rate of a spin rises and falls within its ramps, and is half of the full rate in the middle of each.
TEST(KinematicMotion, SpinTurnsAtItsRateBetweenItsRamps) {
  KinematicMotion motion = at_rest();
  motion.spins = {{Vec3::UnitY(), 3, 1, 9, 2}};
  EXPECT_TRUE(motion_at(motion, 0.9).angular_velocity.isZero(0));
  EXPECT_NEAR(motion_at(motion, 2).angular_velocity.y(), 1.5, 1e-15) << "half way up the ramp";
  EXPECT_EQ(motion_at(motion, 5).angular_velocity.y(), 3);
  EXPECT_NEAR(motion_at(motion, 8).angular_velocity.y(), 1.5, 1e-15);
  EXPECT_NEAR(motion_at(motion, 9).angular_velocity.y(), 0, 1e-15);
  // Each ramp makes half of the angle that the full rate makes in its time.
  EXPECT_LT(motion_at(motion, 20).pose.orientation.angularDistance(exponential(Vec3(0, 3 * (8 - 2), 0))),
            1e-14);

  motion.spins = {{Vec3::UnitY(), 3}};
  EXPECT_EQ(motion_at(motion, 0).angular_velocity.y(), 3) << "without a ramp at once";
  EXPECT_LT(motion_at(motion, 0.5).pose.orientation.angularDistance(exponential(Vec3(0, 1.5, 0))), 1e-15);
}

// The rim of the trampoline of figure 4 is at 3 m up to 2 s, at 4 - cos(pi (t - 2)) m up to 4 s, and at 3 m
// after that.
TEST(KinematicMotion, SinusoidStartsAndStopsWhereTheBodyIs) {
  KinematicMotion motion = at_rest();
  motion.position.value[0] = Vec3(0, 3, 0);
  motion.sinusoids = {{Vec3(0, 1, 0), Vec3::Zero(), 0.5, -pi / 2, 2, 4}};
  for (double time = 0; time < 6; time += 0.125) {
    const bool moves = time >= 2 && time < 4;
    const double phase = pi * (time - 2);
    EXPECT_NEAR(motion_at(motion, time).pose.position.y(), moves ? 4 - std::cos(phase) : 3, 1e-15);
    EXPECT_NEAR(motion_at(motion, time).velocity.y(), moves ? pi * std::sin(phase) : 0, 1e-14);
  }
}

// A motion is given for the shape's coordinates. A point of the shape takes the same path when the body's
// frame is its center of mass.
TEST(KinematicMotion, BodySpaceFollowsTheShapesOwnCoordinates) {
  const KinematicMotion motion = everything();
  KinematicMotion bare = motion;
  bare.frame = Pose{};
  for (double time : {0.1, 0.9, 2.3}) {
    const MotionState body = motion_at(motion, time), shape = motion_at(bare, time);
    const Vec3 point(0.2, 0.5, -0.3);  // in the shape's coordinates
    EXPECT_LT((body.pose.to_world(motion.frame.to_body(point)) - shape.pose.to_world(point)).norm(), 1e-14);
    EXPECT_EQ(body.angular_velocity, shape.angular_velocity);
  }
}

// Bounds over an interval hold for all sampled times, and for simple tracks they are exact or within a factor
// of 2: time steps depend on them.
TEST(KinematicMotion, BoundsHoldAndAreNotFarFromTheTruth) {
  const KinematicMotion motion = everything();
  for (double begin = -0.5; begin < 3; begin += 0.05) {
    const double end = begin + 0.1;
    const MotionBounds bounds = motion_bounds(motion, begin, end);
    for (double time = begin; time <= end; time += 0.01) {
      EXPECT_LE(motion_at(motion, time).velocity.norm(), bounds.speed) << time;
      EXPECT_LE(motion_at(motion, time).angular_velocity.norm(), bounds.spin) << time;
    }
  }
  EXPECT_NEAR(motion_bounds(motion, 0, 1).phase, 2 * pi * 1.7, 1e-14);

  const KinematicMotion steady = through({{0, Vec3::Zero()}, {2, Vec3(4, 0, 0)}}, linear);
  EXPECT_NEAR(motion_bounds(steady, 0.5, 0.6).speed, 2, 1e-14);
  EXPECT_EQ(motion_bounds(steady, 2.5, 3).speed, 0) << "at rest";
  const KinematicMotion gentle = through({{0, Vec3::Zero()}, {2, Vec3(4, 0, 0)}});
  EXPECT_NEAR(motion_bounds(gentle, 0.5, 1.5).speed, 6, 1e-14) << "twice the control polygon; really 3";
}

}  // namespace
}  // namespace duet::kinematic_motion_test
