// Kinematic bodies move as the scene prescribes. They carry, push and shake the others, and nothing disturbs
// them.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::kinematic_test {
namespace {

using scene::RigidBody;
using test::add_ball;
using test::add_box;
using test::add_soft_box;

constexpr double pi = std::numbers::pi, g = 9.8;

// Makes the body kinematic, with the given motion.
RigidBody& make_kinematic(RigidBody& body, const scene::Motion& motion) {
  body.mass.reset();
  body.is_kinematic = true;
  body.motion = motion;
  return body;
}

// Returns a rotation about y at `rate` (rad/s).
scene::Motion spin(double rate) {
  scene::Motion motion;
  motion.spin = {{Vec3::UnitY(), rate / (2 * pi), 0, {}, 0}};
  return motion;
}

// Returns an oscillation of `frequency` (Hz).
scene::Motion shake(const Vec3& amplitude, double frequency) {
  scene::Motion motion;
  motion.sinusoid = {{amplitude, {}, frequency, -90, 0, {}}};  // starts at rest, at the lower end
  return motion;
}

// Returns a uniform motion from `from` that lasts `time` (s).
scene::Motion steady(const Vec3& from, const Vec3& velocity, double time) {
  scene::Motion motion;
  motion.interpolation = Interpolation::linear;
  motion.keyframes = {{0, from, {}, false, {}}, {time, from + time * velocity, {}, false, {}}};
  return motion;
}

// Returns the state of a rigid body.
const RigidState& state(const Simulation& simulation, std::size_t body) {
  return simulation.world().bodies.rigid.state[body];
}

// Returns the position (m) of a rigid body.
const Vec3& position(const Simulation& simulation, std::size_t body) {
  return state(simulation, body).pose.position;
}

// Returns a disc of 2 m radius whose top is at y = 0, and a box 1 m off the axis that turns with it from the
// start.
scene::Scene turntable(double rate, double friction) {
  scene::Scene scene;
  RigidBody disc;
  disc.name = "disc";
  disc.shape.kind = scene::ShapeKind::cylinder;
  disc.shape.radius = 2;
  disc.shape.length = 0.5;
  disc.friction = friction;
  disc.placement.position = Vec3(0, -0.25, 0);
  scene.rigid.push_back(make_kinematic(disc, spin(rate)));
  RigidBody& box = add_box(scene, "box", Vec3(1, 0.2, 0), Vec3(0.4, 0.4, 0.4), 10);
  box.friction = friction;
  box.placement.angular_velocity = Vec3(0, rate, 0);
  box.placement.velocity = box.placement.angular_velocity.cross(Vec3(1, 0, 0));
  return scene;
}

// The circle needs the acceleration w^2 r, and friction can give mu g. The three seconds are one to one and a
// half turns. Contact velocities taken along the tangent at the beginning of every step would carry the box
// outward by 4 to 6 cm in that time.
TEST(Turntable, ABoxStaysInItsPlaceWhileFrictionSuffices) {
  for (const double share : {0.5, 0.9}) {
    SCOPED_TRACE(share);
    const double rate = std::sqrt(share * 0.5 * g);
    scene::Scene scene = turntable(rate, 0.5);
    scene.solver.contact_iterations = 200;
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 1; frame <= 72; ++frame) simulation.advance_frame();
    const Pose& disc = state(simulation, 0).pose;
    // Sweeps stop when they change no velocity by more than 1e-6 m/s. The remaining error is a few times
    // that, over 3 s, and at the edges of the box, 0.2 m off its center.
    EXPECT_LT((disc.to_body(position(simulation, 1)) - Vec3(1, 0.45, 0)).norm(), 1e-5);
    EXPECT_LT(state(simulation, 1).pose.orientation.angularDistance(disc.orientation), 1e-5 / 0.2);
    // The disc itself must be where 3 s of turning bring it, whatever stands on it.
    EXPECT_LT(disc.orientation.angularDistance(Quat(Eigen::AngleAxisd(3 * rate, Vec3::UnitY()))), 1e-13);
    EXPECT_EQ(disc.position, Vec3(0, -0.25, 0));
  }
}

// At 1.1 times the limit of friction the box must slide off.
TEST(Turntable, ABoxSlidesOffWhereFrictionDoesNotSuffice) {
  const scene::Scene scene = turntable(std::sqrt(1.1 * 0.5 * g), 0.5);
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 1; frame <= 72; ++frame) simulation.advance_frame();
  EXPECT_GT(std::hypot(position(simulation, 1).x(), position(simulation, 1).z()), 2);
}

// A box on a platform that goes up and down as A (1 - cos w t), with A w^2 = share * g.
struct Ride {
  static constexpr double omega = 4 * pi;
  double amplitude;
  std::vector<double> gap;  // m, between box and platform, at every frame

  explicit Ride(double share) : amplitude(share * g / (omega * omega)) {
    scene::Scene scene;
    make_kinematic(add_box(scene, "platform", Vec3(0, -0.5, 0), Vec3(4, 1, 4), 1),
                   shake(Vec3(0, amplitude, 0), omega / (2 * pi)));
    add_box(scene, "box", Vec3(0, 0.2, 0), Vec3(0.4, 0.4, 0.4),
            10);  // the default restitution of 0.5 must not matter
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 1; frame <= 48; ++frame) {
      simulation.advance_frame();
      gap.push_back(position(simulation, 1).y() - position(simulation, 0).y() - 0.7);
      // The cosine of an amplitude of 1 m and more loses its last bits only.
      EXPECT_NEAR(position(simulation, 0).y(), height(frame / 24.0) - 0.5, 1e-14);
    }
  }
  // Height of the platform (m) at the time `t` (s), from theory.
  double height(double t) const { return amplitude * (1 - std::cos(omega * t)); }
};

// Below A w^2 = g contact never ends. A platform whose velocity contact sees at the wrong time of the step
// would throw the box or let it sink.
TEST(ShakenPlatform, KeepsABoxThatItDoesNotAccelerateBeyondGravity) {
  for (const double share : {0.8, 0.95})
    for (double gap : Ride(share).gap) EXPECT_NEAR(gap, 0, 1e-6) << share;  // the tolerance of contact
}

// Beyond A w^2 = g the box leaves the platform where cos(w t) = -g / (A w^2), with the platform's speed, and
// flies a parabola.
TEST(ShakenPlatform, ThrowsABoxWhereItFallsFasterThanGravity) {
  const double share = 1.5;
  const Ride ride(share);
  const double release = std::acos(-1 / share) / Ride::omega;
  const double speed = ride.amplitude * Ride::omega * std::sin(Ride::omega * release);
  int in_flight = 0;
  for (std::size_t i = 0; i < ride.gap.size(); ++i) {
    const double t = static_cast<double>(i + 1) / 24, flight = t - release;
    const double expected =
        flight < 0 ? 0 : ride.height(release) + speed * flight - g / 2 * flight * flight - ride.height(t);
    if (expected < 0) break;  // it has landed
    // The release falls into a step of 1/48 s, in which the platform's acceleration changes by 0.4 g. It
    // comes early or late by at most the part of that change that the step averages.
    EXPECT_NEAR(ride.gap[i], expected, 1e-3) << "frame " << i + 1;
    in_flight += expected > 0.01 ? 1 : 0;
  }
  EXPECT_GT(in_flight, 2);
}

// A plate comes at 2 m/s to a ball at rest. It pushes the ball along, or throws it ahead at (1 + e) times its
// own speed; an infinite mass takes no recoil.
TEST(Paddle, HandsOnExactlyItsVelocity) {
  for (const double restitution : {0.0, 0.5, 1.0}) {
    scene::Scene scene = test::free_space();
    RigidBody& paddle = add_box(scene, "paddle", Vec3::Zero(), Vec3(0.2, 1, 1), 1);
    make_kinematic(paddle, steady(Vec3::Zero(), Vec3(2, 0, 0), 10)).restitution = 1;
    add_ball(scene, "ball", Vec3(0.9, 0, 0), 0.3, 5).restitution = restitution;
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 1; frame <= 24; ++frame) simulation.advance_frame();
    EXPECT_TRUE(state(simulation, 1).velocity.isApprox(Vec3(2 * (1 + restitution), 0, 0), 1e-14));
    EXPECT_TRUE(state(simulation, 1).angular_velocity.isZero(1e-14));
    EXPECT_NEAR(position(simulation, 0).x(), 2, 1e-14);
    if (restitution == 0) {
      EXPECT_NEAR(position(simulation, 1).x(), 2.4, 1e-13);  // pushed: it touches
    }
  }
}

// A box that is put on a belt at v = 2 m/s slides for the time v / (mu g), with the acceleration mu g, and
// then moves with the belt.
TEST(Conveyor, TakesABoxAlongByFriction) {
  constexpr double friction = 0.4, speed = 2, time = speed / (friction * g);
  scene::Scene scene;
  RigidBody& belt = add_box(scene, "belt", Vec3::Zero(), Vec3(10, 0.2, 1), 1);
  make_kinematic(belt, steady(Vec3(0, -0.1, 0), Vec3(speed, 0, 0), 10)).friction = friction;
  add_box(scene, "box", Vec3(0, 0.1, 0), Vec3(0.6, 0.2, 0.6), 10).friction = friction;
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 1; frame <= 36; ++frame) {
    simulation.advance_frame();
    const double t = frame / 24.0, sliding = std::min(t, time);
    EXPECT_NEAR(state(simulation, 1).velocity.x(), friction * g * sliding, 1e-4 * speed);
    // When slipping ends within a step is not resolved.
    EXPECT_NEAR(position(simulation, 1).x(), friction * g / 2 * sliding * sliding + speed * (t - sliding),
                speed / 48 / 48);
  }
}

// A platform oscillates below the limit of friction. A soft box on it keeps contact and moves with it.
TEST(ShakenPlatform, ASoftBoxFollows) {
  constexpr double amplitude = 0.15, frequency = 0.7;
  scene::Scene scene;
  make_kinematic(add_box(scene, "platform", Vec3(0, -0.5, 0), Vec3(4, 1, 4), 1),
                 shake(Vec3(amplitude, 0.05, 0), frequency))
      .friction = 1;
  add_soft_box(scene, "soft", Vec3(0, 0.3, 0), Vec3(1, 0.6, 1), 3, 1e6);
  Simulation simulation(scene, test::plan(scene));
  const Particles& particles = simulation.world().bodies.particles;
  std::vector<std::size_t> bottom;
  std::vector<Vec3> start;
  for (std::size_t p = 0; p < particles.size(); ++p)
    if (particles.x[p].y() < 1e-9) {
      bottom.push_back(p);
      start.push_back(particles.x[p]);
    }
  ASSERT_EQ(bottom.size(), 16U);
  double farthest = 0, slip = 0;
  for (int frame = 1; frame <= 48; ++frame) {
    simulation.advance_frame();
    const RigidState& platform = state(simulation, 0);
    const Vec3 way = platform.pose.position - Vec3(0, -0.5, 0);
    farthest = std::max(farthest, way.x());
    for (std::size_t k = 0; k < bottom.size(); ++k) {
      slip = std::max(slip, (particles.x[bottom[k]] - start[k] - way).norm());
      EXPECT_NEAR(particles.x[bottom[k]].y(), way.y(), 1e-9);
      EXPECT_LT((particles.v[bottom[k]] - platform.velocity).norm(), 1e-9);
    }
  }
  EXPECT_LT(slip, 1e-3);  // it creeps a little where it presses least
  EXPECT_NEAR(farthest, 2 * amplitude, 1e-3);
}

// A table reverses at once every 50 ms, always faster than friction lets a box follow: the box gains mu g 50
// ms and loses it again, whatever the table's speed, the frames and the steps are, at every phase of them.
// Steps end at the reversals, so that friction has one direction in each.
TEST(KinematicBody, FrictionReversesWithATableThatReversesAtOnce) {
  const double interval = 0.05, mu = 0.3, gain = mu * g * interval;
  for (const double amplitude : {0.01, 0.2, 2.0})
    for (const double fps : {20.0, 24.0, 30.0})
      for (const double step : {1.0 / 48, 7e-3, 1e-3}) {
        SCOPED_TRACE(testing::Message()
                     << amplitude << " m, " << fps << " frames a second, steps of " << step << " s");
        scene::Scene scene;
        scene.fps = fps;
        scene.solver.max_time_step = step;
        scene::Motion motion;
        motion.interpolation = Interpolation::linear;
        motion.loop = true;
        const Vec3 low(0, -0.25, 0), high(amplitude, -0.25, 0);
        motion.keyframes = {
            {0, low, {}, false, {}}, {interval, high, {}, false, {}}, {2 * interval, low, {}, false, {}}};
        RigidBody& table = make_kinematic(add_box(scene, "table", low, Vec3(20, 0.5, 20), 1), motion);
        table.friction = mu;
        add_box(scene, "box", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 100).friction = mu;
        Simulation simulation(scene, test::plan(scene));
        for (int frame = 0; frame < fps / 2; ++frame) simulation.advance_frame();
        EXPECT_NEAR(position(simulation, 1).x(), 10 * gain * interval / 2, 1e-6);
        EXPECT_NEAR(position(simulation, 1).y(), 0.5, 1e-6);
        EXPECT_NEAR(state(simulation, 1).velocity.x(), 0, 1e-6);
      }
}

// Kinematic bodies ignore the ground, each other, and heavy dynamic bodies, even one that is caught between
// them.
TEST(KinematicBody, PassesThroughOthersOfItsKindAndStopsForNothing) {
  scene::Scene scene = test::on_ground();
  make_kinematic(add_box(scene, "lift", Vec3::Zero(), Vec3(1, 0.2, 1), 1),
                 steady(Vec3(0, 1, 0), Vec3(0, -2, 0), 10));  // into the ground
  make_kinematic(add_box(scene, "gate", Vec3::Zero(), Vec3(0.2, 3, 1), 1),
                 steady(Vec3(-1, 0, 0), Vec3(2, 0, 0), 10));
  add_ball(scene, "ball", Vec3(0, 1.3, 0), 0.2, 1e6);
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 1; frame <= 24; ++frame) {
    simulation.advance_frame();
    EXPECT_LT((position(simulation, 0) - Vec3(0, 1 - frame / 12.0, 0)).norm(), 1e-13);
    EXPECT_LT((position(simulation, 1) - Vec3(-1 + frame / 12.0, 0, 0)).norm(), 1e-13);
    EXPECT_TRUE(state(simulation, 0).velocity.isApprox(Vec3(0, -2, 0), 1e-14));
    EXPECT_TRUE(position(simulation, 2).allFinite());
  }
}

// Without the effect `kinematic_motion` the body does not move and the stage does not run.
TEST(KinematicBody, WithoutTheEffectItStaysAndNoStageRuns) {
  scene::Scene scene = turntable(2, 0.5);
  scene.rigid[1].placement.velocity.setZero();
  scene.rigid[1].placement.angular_velocity.setZero();
  Simulation still(scene, scene::plan_effects(scene, {"kinematic_motion"}).active());
  Simulation turning(scene, test::plan(scene));
  for (Simulation* simulation : {&still, &turning}) simulation->advance_frame();
  EXPECT_EQ(still.world().clock[Stage::kinematic_motion].calls, 0);
  EXPECT_LT(still.stats().kinetic, 1e-9);
  EXPECT_GT(turning.world().clock[Stage::kinematic_motion].calls, 0);
  EXPECT_GT(turning.stats().kinetic, 0.1);

  // A scene in which the disc is static has the same bits.
  scene.rigid[0].is_kinematic = false;
  scene.rigid[0].is_static = true;
  Simulation fixed(scene, test::plan(scene));
  fixed.advance_frame();
  EXPECT_EQ(still.save_state(), fixed.save_state());
}

// The prescribed motion depends on time alone, so a resumed run continues with the same bits.
TEST(KinematicBody, AResumedRunContinuesBitIdentically) {
  scene::Scene scene = turntable(1.5, 0.5);
  scene.rigid[0].motion.sinusoid = {{Vec3(0.1, 0.05, 0), {Vec3::UnitX(), 3}, 1.3, 20, 0, {}}};
  Simulation whole(scene, test::plan(scene)), first(scene, test::plan(scene)),
      second(scene, test::plan(scene));
  for (int i = 0; i < 6; ++i) whole.advance_frame();
  for (int i = 0; i < 3; ++i) first.advance_frame();
  second.load_state(first.save_state());
  for (int i = 0; i < 3; ++i) second.advance_frame();
  EXPECT_EQ(second.save_state(), whole.save_state());
}

}  // namespace
}  // namespace duet::kinematic_test
