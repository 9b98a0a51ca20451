#include "sim/contact/response/warm_start.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <tuple>

#include "tests/support/contacts.h"
#include <gtest/gtest.h>

#include "sim/contact/response/contact_solver.h"

namespace duet::warm_start_test {
namespace {

using test::ContactScene;

constexpr double dt = 1.0 / 64, g = 9.8;

// Returns the entry of the contact cache for a contact with `impulse` (N s) over `duration` (s).
CachedContact remembered(const ContactPoint& contact, const Vec3& impulse, double duration) {
  return {contact.host, contact.guest_rigid, contact.feature, 0, impulse, duration};
}

// Sorts the entries as warm_start() requires.
void sort_by_name(ContactCache& cache) {
  std::sort(cache.begin(), cache.end(), [](const auto& a, const auto& b) {
    return std::tie(a.host, a.guest_rigid, a.feature) < std::tie(b.host, b.guest_rigid, b.feature);
  });
}

// Returns a cube of 1 m and 3 kg that rests on the ground.
ContactScene falling_cube() {
  scene::Scene scene = test::on_ground();
  test::add_box(scene, "cube", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 3);
  return {scene, dt};
}

// Returns a contact cache for that cube: a quarter of its weight on each of its lower corners.
ContactCache memory_of_rest(const ContactScene& cube, double duration) {
  ContactCache cache;
  for (const ContactPoint& contact : cube.contacts.points)
    if ((contact.guest_arm.cwiseAbs() - Vec3::Constant(0.5)).norm() < 1e-12 && contact.guest_arm.y() < 0)
      cache.push_back(remembered(contact, Vec3(0, 3 * g * duration / 4, 0), duration));
  sort_by_name(cache);
  return cache;
}

// Cached forces of rest stop the fall of one step. The bounds are rounding of sums of products of the size g
// dt.
TEST(WarmStart, CachedForcesHoldARestingCube) {
  ContactScene cube = falling_cube();
  cube.state(0).velocity = Vec3(0, -g * dt, 0);
  find_speculative_targets(dt, OrientationUpdate::exact, cube.graph, cube.bodies, cube.contacts);
  const ContactCache cache = memory_of_rest(cube, dt);
  ASSERT_EQ(cache.size(), 4u);
  warm_start(cache, dt, cube.graph, cube.bodies, cube.contacts);
  EXPECT_LT(cube.state(0).velocity.norm(), 1e-15);
  EXPECT_LT(cube.state(0).angular_velocity.norm(), 1e-15);
  EXPECT_EQ(count_active(cube.contacts, cube.graph), 4);
  // The solve has nothing left to do and ends after one sweep.
  ContactSolveScratch scratch;
  EXPECT_EQ(solve_contact(cube.bodies, cube.graph, {}, cube.contacts, scratch), 1);
  EXPECT_LT(cube.state(0).velocity.norm(), 1e-14);
}

// The impulses that a solve ended with, cached and applied again in the same state, give its solution at
// once.
TEST(WarmStart, WhatASolveEndedWithIsWhatTheNextOneBeginsWith) {
  ContactScene cube = falling_cube();
  const RigidState start = cube.state(0);
  const auto fall = [&] {
    cube.state(0) = start;
    cube.state(0).velocity = Vec3(0.001, -g * dt, 0);
    find_speculative_targets(dt, OrientationUpdate::exact, cube.graph, cube.bodies, cube.contacts);
  };
  fall();
  warm_start({}, dt, cube.graph, cube.bodies, cube.contacts);
  EXPECT_EQ(cube.state(0).velocity, Vec3(0.001, -g * dt, 0)) << "nothing remembered, nothing done";
  ContactSolveScratch scratch;
  solve_contact(cube.bodies, cube.graph, {.iterations = 1000, .tolerance = 1e-13}, cube.contacts, scratch);
  ContactCache cache;
  store_contacts(cube.contacts, cube.graph, dt, cache);
  ASSERT_FALSE(cache.empty());
  EXPECT_EQ(static_cast<int>(cache.size()), count_active(cube.contacts, cube.graph));
  EXPECT_TRUE(std::is_sorted(cache.begin(), cache.end(), [](const auto& a, const auto& b) {
    return a.feature < b.feature;  // host and guest are the same for all
  }));
  fall();
  warm_start(cache, dt, cube.graph, cube.bodies, cube.contacts);
  EXPECT_LT(cube.state(0).velocity.norm(), 1e-12);
  EXPECT_LT(cube.state(0).angular_velocity.norm(), 1e-12);
}

// A cached force acts over the next step, in proportion to its length, but no longer than it acted before.
TEST(WarmStart, AForceLastsAsLongAsTheStepButNoLongerThanItDid) {
  ContactScene cube = falling_cube();
  for (const double duration : {dt / 4, dt, 4 * dt}) {
    cube.state(0).velocity = Vec3(0, -g, 0);  // so fast that no impulse is scaled down
    find_speculative_targets(dt, OrientationUpdate::exact, cube.graph, cube.bodies, cube.contacts);
    warm_start(memory_of_rest(cube, dt), duration, cube.graph, cube.bodies, cube.contacts);
    const double expected = g * std::min(duration, dt);
    EXPECT_NEAR(cube.state(0).velocity.y() + g, expected, 1e-14) << duration;
    for (const ContactPoint& contact : cube.contacts.points)
      if (!contact.impulse.isZero(0)) {
        EXPECT_NEAR(contact.impulse.y(), 3 * expected / 4, 1e-15) << duration;
      }
  }
}

// Returns balls of 2 kg that touch the ground, each an island of its own.
ContactScene balls_on_ground(int count) {
  scene::Scene scene = test::on_ground();
  for (int i = 0; i < count; ++i) test::add_ball(scene, "ball" + std::to_string(i), Vec3(3 * i, 1, 0), 1, 2);
  return {scene, dt};
}

// Ball 0 has ten times the impulse that stops it in the cache, ball 1 an impulse though it already rises, and
// ball 2 its weight. Each island is scaled by itself: to the fraction that brings its contact to its target,
// to nothing, and not at all.
TEST(WarmStart, ScalesImpulsesDownIslandByIsland) {
  ContactScene balls = balls_on_ground(3);
  ASSERT_EQ(balls.contacts.points.size(), 3u);
  const double fall = g * dt;
  balls.state(0).velocity = balls.state(2).velocity = Vec3(0, -fall, 0);
  balls.state(1).velocity = Vec3(0, 1, 0);
  find_speculative_targets(dt, OrientationUpdate::exact, balls.graph, balls.bodies, balls.contacts);
  ContactCache cache;
  for (const ContactPoint& contact : balls.contacts.points) {
    const double factor[] = {10, 1, 1};
    cache.push_back(remembered(contact, Vec3(0, 2 * fall * factor[as_index(contact.guest_rigid)], 0), dt));
  }
  sort_by_name(cache);
  warm_start(cache, dt, balls.graph, balls.bodies, balls.contacts);
  EXPECT_LT(balls.state(0).velocity.norm(), 1e-14);
  EXPECT_EQ(balls.state(1).velocity, Vec3(0, 1, 0));
  EXPECT_LT(balls.state(2).velocity.norm(), 1e-15);
  for (const ContactPoint& contact : balls.contacts.points) {
    const double expected = contact.guest_rigid == 1 ? 0 : 2 * fall;
    EXPECT_NEAR(contact.impulse.y(), expected, 1e-14);
  }
  const Vec3& kept = balls.contacts.points[2].impulse;
  EXPECT_EQ(kept, Vec3(0, 2 * fall, 0)) << "to the bit";
}

// A ball that may still close a gap of 1/128 m in 1/64 s is slowed down to 0.5 m/s and no further.
TEST(WarmStart, ABlowLeavesTheSpeedThatClosesTheGap) {
  ContactScene ball = balls_on_ground(1);
  ball.state(0).pose.position.y() += 1.0 / 128;
  ball.state(0).velocity = Vec3(0, -3, 0);
  ball.find(dt);
  find_speculative_targets(dt, OrientationUpdate::exact, ball.graph, ball.bodies, ball.contacts);
  ASSERT_EQ(ball.contacts.points.size(), 1u);
  warm_start({remembered(ball.contacts.points[0], Vec3(0, 100, 0), dt)}, dt, ball.graph, ball.bodies,
             ball.contacts);
  EXPECT_NEAR(ball.state(0).velocity.y(), -0.5, 1e-13);
}

// Returns the kinetic energy of all rigid bodies, J.
double kinetic_energy_of(const ContactScene& scene) {
  double energy = 0;
  for (std::size_t i = 0; i < scene.bodies.rigid.size(); ++i)
    energy += kinetic_energy(scene.bodies.rigid.state[i], scene.bodies.rigid.properties[i]);
  return energy;
}

// With all targets at rest, the distance of an island from its targets is its kinetic energy. If the cached
// impulses together decrease it, all of them are applied. Otherwise the energy after the warm start is no
// larger than with none of them and with any fraction of them, in steps of 0.05. Random impulses reach all
// three cases at least ten times.
TEST(WarmStart, ScalesEachIslandByTheBestFraction) {
  scene::Scene scene = test::on_ground();
  test::add_box(scene, "lower", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 3);
  test::add_box(scene, "upper", Vec3(0.2, 1.5, 0.1), Vec3(1, 1, 1), 5);
  ContactScene tower(scene, dt);
  ASSERT_GT(tower.contacts.points.size(), 8u);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] {
    Vec3 v;
    for (int axis = 2; axis >= 0; --axis) v[axis] = uniform(random);
    return v;
  };
  int all = 0, some = 0, none = 0;
  for (int i = 0; i < 200; ++i) {
    for (std::size_t body = 0; body < 2; ++body) {
      RigidState& state = tower.state(body);
      state.velocity = vector();
      set_angular_velocity(state, tower.bodies.rigid.properties[body], vector());
    }
    for (ContactPoint& contact : tower.contacts.points) contact.target = 0;
    const RigidState start[] = {tower.state(0), tower.state(1)};
    ContactCache cache;
    for (const ContactPoint& contact : tower.contacts.points)
      cache.push_back(remembered(contact, std::pow(10, 1.5 * uniform(random) - 1.5) * vector(), dt));
    sort_by_name(cache);
    const auto energy_with = [&](double share) {
      for (std::size_t body = 0; body < 2; ++body) tower.state(body) = start[body];
      for (const ContactPoint& contact : tower.contacts.points)
        for (const CachedContact& past : cache)
          if (std::tie(past.host, past.guest_rigid, past.feature) ==
              std::tie(contact.host, contact.guest_rigid, contact.feature))
            apply_impulse(tower.bodies, contact, share * past.impulse);
      return kinetic_energy_of(tower);
    };
    const double without = energy_with(0), with_all = energy_with(1);
    double best = std::min(without, with_all);
    if (with_all >= without)
      for (double share = 0.05; share < 1; share += 0.05) best = std::min(best, energy_with(share));
    energy_with(0);
    warm_start(cache, dt, tower.graph, tower.bodies, tower.contacts);
    const double energy = kinetic_energy_of(tower);
    EXPECT_LE(energy, best * (1 + 1e-12));
    if (with_all < without) {
      ++all;
      EXPECT_NEAR(energy, with_all, 1e-12 * with_all);
    } else {
      (energy < without * (1 - 1e-12) ? some : none) += 1;
    }
    // The contacts hold the impulses that were applied: taking them back restores the velocities.
    for (const ContactPoint& contact : tower.contacts.points)
      apply_impulse(tower.bodies, contact, -contact.impulse);
    for (std::size_t body = 0; body < 2; ++body)
      EXPECT_LT((tower.state(body).velocity - start[body].velocity).norm(), 1e-12);
  }
  EXPECT_GT(all, 10);
  EXPECT_GT(some, 10);
  EXPECT_GT(none, 10);
}

// A contact with the target minus infinity gets no impulse from the cache: it would push without touching.
TEST(WarmStart, ContactsOutOfReachTakeNothing) {
  ContactScene ball = balls_on_ground(1);
  ball.state(0).velocity = Vec3(0, -1, 0);
  ball.contacts.points[0].target = -std::numeric_limits<double>::infinity();
  warm_start({remembered(ball.contacts.points[0], Vec3(0, 1, 0), dt)}, dt, ball.graph, ball.bodies,
             ball.contacts);
  EXPECT_EQ(ball.state(0).velocity, Vec3(0, -1, 0));
  EXPECT_TRUE(ball.contacts.points[0].impulse.isZero(0));
}

// A cached impulse belongs to the point that its entry names and to no other point of the same bodies.
TEST(WarmStart, AnotherPointOfTheSameBodiesTakesNothing) {
  ContactScene cube = falling_cube();
  ContactCache cache = memory_of_rest(cube, dt);
  for (CachedContact& past : cache) past.feature.index += 100000;
  cube.state(0).velocity = Vec3(0, -g * dt, 0);
  find_speculative_targets(dt, OrientationUpdate::exact, cube.graph, cube.bodies, cube.contacts);
  warm_start(cache, dt, cube.graph, cube.bodies, cube.contacts);
  EXPECT_EQ(cube.state(0).velocity, Vec3(0, -g * dt, 0));
}

// A ball that is `height` (m) above the ground may close its gap within the step and no more; a ball that
// overlaps may stay as deep. The bound is rounding of the position, 1e-16 m, over 1/64 s, with a margin.
TEST(SpeculativeTargets, ABallMayCloseJustItsGap) {
  for (const double height : {0.01, 0.001, 0.0, -0.001, -0.01})
    for (const Vec3& velocity : {Vec3(0, -3, 0), Vec3(5, -1, -2), Vec3(0, 0, 0), Vec3(0, -200, 0)}) {
      scene::Scene scene = test::on_ground();
      test::add_ball(scene, "ball", Vec3(2, 1 + height, 0), 1, 2).placement.velocity = velocity;
      ContactScene ball(scene, 1);
      // What is at rest so far above the ground is out of reach.
      const bool is_near = height < 0.01 || !velocity.isZero(0);
      ASSERT_EQ(ball.contacts.points.size(), is_near ? 1u : 0u);
      if (!is_near) continue;
      find_speculative_targets(dt, OrientationUpdate::exact, ball.graph, ball.bodies, ball.contacts);
      EXPECT_NEAR(ball.contacts.points[0].target, -std::max(height, 0.0) / dt, 1e-12);
    }
}

// A point at the arm r of a turning cube, after the angle a about z, lies r.x sin a + r.y cos a above the
// center. The target of every corner and sample contains its exact height. To first order the target is minus
// the gap over the time; the rest is r.y a^2 / (2 dt), and terms of order a^3 / dt.
TEST(SpeculativeTargets, FollowTheArcOfATurningCube) {
  constexpr double height = 0.52, fall = 0.75, spin = 3;
  scene::Scene scene = test::on_ground();
  auto& cube = test::add_box(scene, "cube", Vec3(0, height, 0), Vec3(1, 1, 1), 6);
  cube.placement.velocity = Vec3(0, -fall, 0);
  cube.placement.angular_velocity = Vec3(0, 0, spin);
  ContactScene turning(scene, dt);
  find_speculative_targets(dt, OrientationUpdate::exact, turning.graph, turning.bodies, turning.contacts);
  const double a = spin * dt;
  int corners = 0;
  for (const ContactPoint& contact : turning.contacts.points) {
    const Vec3& r = contact.guest_arm;
    corners += std::abs(std::abs(r.x()) - 0.5) < 1e-12;
    EXPECT_NEAR(contact.gap, height + r.y(), 1e-15);
    const double speed = -fall + spin * r.x();
    const double later = height - fall * dt + r.x() * std::sin(a) + r.y() * std::cos(a);
    EXPECT_NEAR(contact.target, speed - later / dt, 1e-13);
    EXPECT_NEAR(contact.target, -contact.gap / dt + r.y() * a * a / (2 * dt), a * a * a / dt);
  }
  EXPECT_GE(corners, 4);
}

// A ball glides off another one. After the distance s = 1/64 m along the tangent the gap is sqrt(4 + s^2) - 2
// (m).
TEST(SpeculativeTargets, OnACurvedHostTheGapOpensByItself) {
  scene::Scene scene = test::free_space();
  test::add_ball(scene, "host", Vec3(0, 0, 0), 1, 2);
  test::add_ball(scene, "guest", Vec3(0, 2, 0), 1, 2).placement.velocity = Vec3(1, 0, 0);
  ContactScene balls(scene, dt);
  find_speculative_targets(dt, OrientationUpdate::exact, balls.graph, balls.bodies, balls.contacts);
  ASSERT_EQ(balls.contacts.points.size(), 2u);  // the support point of each
  for (const ContactPoint& contact : balls.contacts.points)
    EXPECT_NEAR(contact.target, -(std::sqrt(4 + dt * dt) - 2) / dt, 1e-13);
}

// A particle of a soft body would move far in a step if nothing stopped it. Only the part of its normal
// velocity that closes the gap enters the prediction. On a ball the particle follows the tangent by s = 5/64
// m.
TEST(SpeculativeTargets, OfSoftBodiesCountTheMotionUpToContact) {
  const double sideways = 5, radius = 2;
  for (const double gap : {0.0, 0.01})
    for (const double inward : {1.0, 10.0, 100.0}) {
      scene::Scene scene = test::free_space();
      test::add_ball(scene, "host", Vec3(0, 0, 0), radius, 2).is_static = true;
      auto& guest = test::add_soft_box(scene, "guest", Vec3(0, 2.5 + gap, 0), Vec3(1, 1, 1), 2);
      guest.placement.velocity = Vec3(sideways, -inward, 0);
      ContactScene touching(scene, dt);
      find_speculative_targets(dt, OrientationUpdate::exact, touching.graph, touching.bodies,
                               touching.contacts);
      const auto& points = touching.contacts.points;
      const auto first = std::find_if(points.begin(), points.end(), [&](const ContactPoint& contact) {
        return (weighted(surface_point(touching.bodies, contact), touching.bodies.particles.x) -
                Vec3(0, radius + gap, 0))
                   .norm() < 1e-12;
      });
      ASSERT_NE(first, points.end());
      const double closed = inward * dt > gap ? gap : inward * dt;
      const double later = std::hypot(radius + gap - closed, sideways * dt) - radius;
      EXPECT_NEAR(first->target, -closed / dt - later / dt, 1e-12) << gap << ", " << inward;
    }
}

// A ball would pass through the center of another one within the step. The gap on the far side means nothing,
// and the present gap counts.
TEST(SpeculativeTargets, BeyondABodysCenterUseThePresentGap) {
  scene::Scene scene = test::free_space();
  test::add_ball(scene, "host", Vec3(0, 0, 0), 1, 2);
  test::add_ball(scene, "guest", Vec3(0, 2.25, 0), 1, 2).placement.velocity = Vec3(0, -3 / dt, 0);
  ContactScene balls(scene, dt);
  find_speculative_targets(dt, OrientationUpdate::exact, balls.graph, balls.bodies, balls.contacts);
  ASSERT_EQ(balls.contacts.points.size(), 2u);
  for (const ContactPoint& contact : balls.contacts.points) EXPECT_NEAR(contact.target, -0.25 / dt, 1e-13);
}

// The support point of a rolling wheel acts for its samples, whose targets are minus infinity.
TEST(SpeculativeTargets, IgnoreSamplesBesideASupportPoint) {
  scene::Scene scene = test::on_ground();
  auto& wheel = test::add_ball(scene, "wheel", Vec3(0, 0.6, 0), 1, 2);
  wheel.shape = {.kind = scene::ShapeKind::torus, .radius = 0.5, .tube = 0.1};
  wheel.placement.orientation = Quat(Eigen::AngleAxisd(EIGEN_PI / 2, Vec3::UnitX()));
  wheel.placement.velocity = Vec3(1, 0, 0);
  wheel.placement.angular_velocity = Vec3(0, 0, -1 / 0.6);
  ContactScene rolling(scene, dt);
  find_speculative_targets(dt, OrientationUpdate::exact, rolling.graph, rolling.bodies, rolling.contacts);
  int samples = 0;
  for (const ContactPoint& contact : rolling.contacts.points) {
    EXPECT_EQ(std::isinf(contact.target), contact.is_sample());
    samples += contact.is_sample();
  }
  EXPECT_GE(samples, 1);
}

// After a displacement of the ball, gap and arms are those of its new position.
TEST(UpdateContacts, TakesGapsAndArmsAtThePositionsNow) {
  ContactScene ball = balls_on_ground(1);
  ball.state(0).pose.position += Vec3(0.5, 0.25, 0);
  update_contacts(ball.graph, ball.bodies, ball.contacts);
  EXPECT_EQ(ball.contacts.points[0].gap, 0.25);
  EXPECT_EQ(ball.contacts.points[0].guest_arm, Vec3(0, -1, 0));
  EXPECT_EQ(ball.contacts.points[0].host_arm, Vec3(0.5, 0.25, 0));
}

}  // namespace
}  // namespace duet::warm_start_test
