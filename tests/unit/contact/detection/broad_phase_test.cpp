// Compares the pairs of the broad phase, and the contact candidates that follow from them, with brute force
// over all pairs and all points.
#include "sim/contact/detection/broad_phase.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "tests/support/meshes.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/base/parallel.h"
#include "sim/contact/detection/contact_candidates.h"
#include "sim/contact/detection/max_penetration.h"
#include "sim/contact/detection/ring_contacts.h"
#include "sim/contact/detection/shape_support_point.h"
#include "sim/step/world.h"

namespace duet::broad_phase_test {
namespace {

constexpr double frame = 1.0 / 24;  // s

// Gives a body a random place within `size` (m), orientation, velocity up to `speed` (m/s) and spin (rad/s).
void move_at_random(scene::Placement& placement, std::mt19937& random, double size, double speed,
                    double spin) {
  placement.position = size * test::random_vector(random);
  placement.orientation = test::random_rotation(random);
  placement.velocity = speed * test::random_vector(random);
  placement.angular_velocity = spin * test::random_vector(random);
}

// A random crowd of all shapes: cards, long bars, and a ball of 4 m that holds all others, some at 500 m/s or
// spinning fast; with static bodies, a ground and soft boxes.
scene::Scene crowd(unsigned seed) {
  std::mt19937 random(seed);
  scene::Scene scene = test::on_ground();
  scene.ground->height = -1;
  scene.solver.deformable_collision = false;  // the soft boxes intersect each other at the start
  for (int i = 0; i < 60; ++i) {
    const std::string name = "body" + std::to_string(i);
    auto& body = i % 3 == 0 ? test::add_ball(scene, name, Vec3::Zero(), i == 30 ? 4 : 0.2, 1)
                            : test::add_box(scene, name, Vec3::Zero(), Vec3(0.3, 0.2, 0.4), 1);
    if (i % 10 == 1) body.shape.size = Vec3(3, 0.05, 0.05);
    if (i % 10 == 2) body.shape.size = Vec3(0.5, 0.001, 0.5);
    if (i % 10 == 4) {
      body.shape.kind = scene::ShapeKind::capsule;
      body.shape.radius = 0.1;
      body.shape.length = 1;
    }
    if (i % 10 == 5) {
      body.shape.kind = scene::ShapeKind::torus;
      body.shape.radius = 0.4;
      body.shape.tube = 0.1;
    }
    move_at_random(body.placement, random, 3, i % 8 == 0 ? 500 : 2, i % 7 == 0 ? 30 : 2);
    if (i % 9 != 8) continue;
    body.is_static = true;
    body.mass.reset();
    body.placement.velocity.setZero();
    body.placement.angular_velocity.setZero();
  }
  for (int i = 0; i < 4; ++i) {
    auto& soft = test::add_soft_box(scene, "soft" + std::to_string(i), Vec3::Zero(), Vec3(1, 0.5, 0.7), 3);
    move_at_random(soft.placement, random, 2, i == 0 ? 100 : 1, i == 1 ? 20 : 1);
  }
  return scene;
}

// Returns the pairs that the bounds and margins of a broad phase demand, by brute force and in its order.
std::vector<BodyPair> all_pairs(const BroadPhase& broad_phase, int rigid_count) {
  const auto& bounds = broad_phase.bounds;
  const auto meets = [&](std::size_t a, std::size_t b) {
    const double margin = broad_phase.margin[a] + broad_phase.margin[b];
    if (bounds[a].is_half_space) return separation(bounds[a], bounds[b]) <= margin;
    return world_box(bounds[a], broad_phase.margin[a])
        .intersects(world_box(bounds[b], broad_phase.margin[b]));
  };
  std::vector<BodyPair> pairs;
  for (int h = 0; h < rigid_count; ++h)
    for (int g = 0; g < rigid_count; ++g) {
      const auto a = static_cast<std::size_t>(h), b = static_cast<std::size_t>(g);
      if (bounds[b].is_half_space || (!bounds[a].is_half_space && h >= g)) continue;
      if (!bounds[a].is_dynamic && !bounds[b].is_dynamic) continue;
      if (meets(a, b)) pairs.push_back({h, g, -1});
    }
  for (std::size_t d = static_cast<std::size_t>(rigid_count); d < bounds.size(); ++d)
    for (int h = 0; h < rigid_count; ++h)
      if (meets(static_cast<std::size_t>(h), d)) pairs.push_back({h, -1, static_cast<int>(d) - rigid_count});
  return pairs;
}

// The pairs of boxes that meet within their margins are found completely and in the order of brute force, on
// any number of threads. The order of pairs decides the order of contacts, and so the bits of the state.
TEST(BroadPhase, FindsThePairsOfAllAgainstAllInTheirOrder) {
  BroadPhase broad_phase;  // one object for all seeds: nothing of an earlier scene may stay
  std::size_t found = 0, possible = 0;
  for (unsigned seed = 0; seed < 3; ++seed) {
    const scene::Scene scene = crowd(seed);
    Simulation simulation(scene, test::plan(scene));
    const Bodies& bodies = simulation.world().bodies;
    bound_bodies(bodies, broad_phase.bounds);
    broad_phase.margin.resize(broad_phase.bounds.size());
    for (std::size_t i = 0; i < broad_phase.margin.size(); ++i)
      broad_phase.margin[i] = 1e-3 * static_cast<double>(i % 5) * fastest(broad_phase.bounds[i]);
    const auto expected = all_pairs(broad_phase, static_cast<int>(bodies.rigid.size()));
    for (int threads : {1, 3}) {
      set_thread_count(threads);
      EXPECT_EQ(broad_phase.find({}), expected) << "seed " << seed << ", " << threads << " threads";
    }
    set_thread_count(0);
    found += expected.size();
    possible += bodies.rigid.size() * bodies.rigid.size();
  }
  EXPECT_GT(found, 250u);
  EXPECT_LT(found, possible / 4) << "the scenes are too dense to tell anything";
}

// Moves bodies from call to call as in a scene: most of them jostle and some fly, and now and then one stops,
// starts or is placed elsewhere.
class Motion {
 public:
  Motion(const Bodies& bodies, unsigned seed) : random_(seed), speed_(bodies.rigid.size()) {
    for (double& speed : speed_) speed = uniform_(random_) < 0.2 ? 0.2 : 0.002;
  }

  void move(Bodies& bodies) {
    for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
      if (!bodies.rigid.properties[i].is_dynamic()) continue;
      RigidState& state = bodies.rigid.state[i];
      if (uniform_(random_) < 0.01) speed_[i] = uniform_(random_) < 0.5 ? 0 : 0.1;
      state.pose.position += speed_[i] * test::random_vector(random_);
      if (uniform_(random_) > 0.005) continue;
      state.pose.position = 3 * test::random_vector(random_);
      state.pose.orientation = test::random_rotation(random_);
    }
    for (const DeformableBody& body : bodies.deformable) {
      const Vec3 shift = 0.05 * test::random_vector(random_);
      for (int p = body.first_particle; p < body.first_particle + body.particle_count; ++p)
        bodies.particles.x[static_cast<std::size_t>(p)] += shift;
    }
  }

 private:
  std::mt19937 random_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  std::vector<double> speed_;  // m per call
};

// Pairs that persist from call to call are those that a fresh search would find, while margins change as the
// time step does. The counters prove that both cases occur, and they do not depend on the number of threads.
// A body that left its enlarged box unnoticed would miss a pair.
TEST(BroadPhase, FindsThePairsOfAllAgainstAllHoweverBodiesMoved) {
  const scene::Scene scene = crowd(7);
  Simulation simulation(scene, test::plan(scene));
  Bodies& bodies = simulation.world().bodies;
  BroadPhase alone, together;
  Motion motion(bodies, 8);
  const int calls = 300;
  for (int call = 0; call < calls; ++call) {
    motion.move(bodies);
    const double dt = call % 20 == 0 ? 2e-3 : 2e-4;  // s
    for (BroadPhase* broad_phase : {&alone, &together}) {
      set_thread_count(broad_phase == &alone ? 1 : 3);
      bound_bodies(bodies, broad_phase->bounds);
      broad_phase->margin.resize(broad_phase->bounds.size());
      for (std::size_t i = 0; i < broad_phase->margin.size(); ++i)
        broad_phase->margin[i] = dt * fastest(broad_phase->bounds[i]);
      ASSERT_EQ(broad_phase->find({}), all_pairs(*broad_phase, static_cast<int>(bodies.rigid.size())))
          << "call " << call;
    }
  }
  set_thread_count(0);
  EXPECT_GT(alone.counts().kept, alone.counts().found) << "most pairs persist";
  EXPECT_GT(alone.counts().found, calls) << "the scene is too calm to tell anything";
  EXPECT_EQ(alone.counts().kept, together.counts().kept);
  EXPECT_EQ(alone.counts().found, together.counts().found);
}

// A heap of 4 x 4 x 4 balls that are 1 mm apart: 48 neighboring pairs along each axis, and more across.
struct Heap {
  Bodies bodies;
  BroadPhase broad_phase;

  Heap() {
    scene::Scene scene = test::free_space();
    for (int i = 0; i < 64; ++i)
      test::add_ball(scene, "ball" + std::to_string(i), 0.201 * Vec3(i % 4, i / 4 % 4, i / 16), 0.1, 1);
    bodies = Simulation(scene, test::plan(scene)).world().bodies;
  }
  // Returns the number of pairs with a margin of 1 mm for every body.
  std::size_t find(const CandidateFilter& filter = {}) {
    bound_bodies(bodies, broad_phase.bounds);
    broad_phase.margin.assign(broad_phase.bounds.size(), 1e-3);
    return broad_phase.find(filter).size();
  }
};

// Bodies that stay within their enlarged boxes keep their pairs: no call after the first searches for any.
TEST(BroadPhase, KeepsThePairsOfBodiesThatStayWhereTheyAre) {
  Heap heap;
  const std::size_t pairs = heap.find();
  EXPECT_GE(pairs, 3u * 48u);
  const std::int64_t found = heap.broad_phase.counts().found;
  EXPECT_GE(found, static_cast<std::int64_t>(pairs));
  EXPECT_EQ(heap.broad_phase.counts().kept, 0);
  for (int call = 1; call <= 5; ++call) {
    for (RigidState& state : heap.bodies.rigid.state) state.pose.position.x() += 5e-4;  // 2.5 mm in total
    EXPECT_EQ(heap.find(), pairs);
    EXPECT_EQ(heap.broad_phase.counts().found, found);
    EXPECT_EQ(heap.broad_phase.counts().kept, call * found);
  }
}

// If one body leaves its box, only its own pairs are searched again.
TEST(BroadPhase, LooksOnlyForThePairsOfTheBodyThatLeft) {
  Heap heap;
  heap.find();
  const std::int64_t all = heap.broad_phase.counts().found;
  // The ball leaves the corner of the heap, where it had 3 to 7 pairs.
  heap.bodies.rigid.state[0].pose.position = Vec3(-10, 0, 0);
  heap.find();
  EXPECT_EQ(heap.broad_phase.counts().found, all);
  const std::int64_t kept = heap.broad_phase.counts().kept;
  EXPECT_GE(kept, all - 7);
  EXPECT_LE(kept, all - 3);
  heap.bodies.rigid.state[0].pose.position = Vec3(0, 0, 0);
  heap.find();
  EXPECT_EQ(heap.broad_phase.counts().found, all + (all - kept)) << "the same as before";
  EXPECT_EQ(heap.broad_phase.counts().kept, kept + kept);
}

// A body that was fast and has come to rest gets a small box again: it does not keep the enlarged box of its
// flight, whose many pairs would be tested in every step.
TEST(BroadPhase, WhatCameToRestHasLittleRoom) {
  Heap heap;
  heap.find();
  heap.broad_phase.margin[0] = 1;
  heap.broad_phase.find({});
  const auto added = [&] {
    const std::int64_t before = heap.broad_phase.counts().kept;
    heap.find();
    return heap.broad_phase.counts().kept - before;
  };
  added();
  const std::int64_t at_rest = added();
  Heap calm;
  calm.find();
  EXPECT_EQ(at_rest, calm.broad_phase.counts().found);
}

// A call without rigid pairs returns none of those that were kept, and the next call with them returns all
// again.
TEST(BroadPhase, ForgetsPairsThatAreNoLongerWanted) {
  Heap heap;
  const std::size_t pairs = heap.find();
  EXPECT_EQ(heap.find({.rigid_pairs = false}), 0u);
  EXPECT_EQ(heap.find(), pairs);
}

// The enlarged boxes of a resumed run differ from those of the run that went through, and this must not show
// in the state. A run that went on to another state and returned has different boxes again.
TEST(BroadPhase, LeavesNoTraceInASimulation) {
  std::mt19937 random(4);
  scene::Scene scene = test::on_ground();
  for (int i = 0; i < 24; ++i) {
    const Vec3 at = 0.5 * Vec3(i % 3, 1 + i / 9, i / 3 % 3);
    auto& body = i % 2 == 0 ? test::add_ball(scene, "body" + std::to_string(i), at, 0.2, 1)
                            : test::add_box(scene, "body" + std::to_string(i), at, Vec3(0.3, 0.2, 0.4), 1);
    body.placement.velocity = 3 * test::random_vector(random);
  }
  Simulation through(scene, test::plan(scene)), resumed(scene, test::plan(scene)),
      returned(scene, test::plan(scene));
  const auto advance = [](Simulation& simulation, int frames) {
    for (int i = 0; i < frames; ++i) simulation.advance_frame();
    return simulation.stats().hash;
  };
  advance(through, 6);
  resumed.load_state(through.save_state());
  advance(returned, 10);
  returned.load_state(through.save_state());
  const auto hash = advance(through, 6);
  EXPECT_EQ(advance(resumed, 6), hash);
  EXPECT_EQ(advance(returned, 6), hash);
  EXPECT_GT(through.world().context.contact.contacts.search.broad_phase.counts().kept, 0);
}

// Returns the difference of the velocities of all bodies from themselves, which is zero.
VelocityState no_change(const Bodies& bodies) {
  VelocityState now, change;
  store_velocities(bodies, now);
  velocity_difference(bodies, now, change);
  return change;
}

using PointName = std::tuple<int, int, FeatureId>;  // host, rigid guest, point

// Returns the points that would lie inside of a body at the end of the step if nothing pushed them. Contact
// has to start from all of these, except points on the far side of a body that goes in as a whole, points
// beside an edge (their gap is infinite), samples that the support points of a round host or guest stand for,
// and support points that a ball or ring contacts stand for.
std::set<PointName> points_inside_after(const Bodies& bodies, double dt) {
  const std::vector<RigidState>& state = bodies.rigid.state;
  std::vector<Pose> later;
  for (const RigidState& body : state)
    later.push_back(evolved_pose(body, dt, OrientationUpdate::first_order));
  std::set<PointName> inside;
  for (std::size_t h = 0; h < later.size(); ++h) {
    const RigidProperties& host = bodies.rigid.properties[h];
    for (std::size_t g = 0; g < later.size(); ++g) {
      const RigidProperties& guest = bodies.rigid.properties[g];
      if (g == h || (!host.is_dynamic() && !guest.is_dynamic())) continue;
      const int samples = static_cast<int>(guest.samples.size());
      for (int i = -support_point_count(guest.shape); i < samples; ++i) {
        if (i < 0 && (is_left_to_ball(host.shape, guest.shape) || touch_along_ring(host.shape, guest.shape)))
          continue;
        if (i >= 0 && (ignores_samples(host.shape, guest.shape) ||
                       (rolls_over_samples(host.shape) && guest.on_flat[static_cast<std::size_t>(i)] != 0)))
          continue;
        const FeatureId place = i < 0 ? FeatureId::support(-1 - i) : FeatureId::point(i);
        const double now = touch(host, state[h].pose, guest, state[g].pose, place).gap;
        const Vec3 x = later[h].to_body(touch(host, later[h], guest, later[g], place).position);
        if (std::isfinite(now) && host.shape.distance(x) < 0)
          inside.insert({static_cast<int>(h), static_cast<int>(g), place});
      }
    }
    for (std::size_t i = 0; i < bodies.points.size(); ++i) {
      const Vec3 x = weighted(bodies.points[i], bodies.particles.x) +
                     dt * weighted(bodies.points[i], bodies.particles.v);
      if (host.shape.distance(later[h].to_body(x)) + bodies.points[i].contact_offset < 0)
        inside.insert({static_cast<int>(h), -1, FeatureId::point(static_cast<int>(i))});
    }
  }
  return inside;
}

// No point that ends up inside of a body within the step is missing among the candidates, and none is found
// twice. A margin that forgets spin, or the motion of one of the two bodies, would miss points of the fast
// bodies.
TEST(ContactCandidates, MissNoPointThatEndsUpInsideABody) {
  ContactSet contacts;
  CandidateFilter filter;
  filter.reduce_contacts = false;
  for (const unsigned seed : {10U}) {
    const scene::Scene scene = crowd(seed);
    Simulation simulation(scene, test::plan(scene));
    const Bodies& bodies = simulation.world().bodies;
    const VelocityState none = no_change(bodies);
    for (const double dt : {frame / 50, frame / 5}) {
      find_candidates(bodies, filter, dt, none, contacts);
      std::set<PointName> candidates;
      for (const ContactPoint& contact : contacts.points)
        candidates.insert({contact.host, contact.guest_rigid, contact.feature});
      EXPECT_EQ(candidates.size(), contacts.points.size()) << "no point is found twice";
      const std::set<PointName> inside = points_inside_after(bodies, dt);
      EXPECT_GT(inside.size(), 100u);
      std::vector<PointName> missed;
      std::set_difference(inside.begin(), inside.end(), candidates.begin(), candidates.end(),
                          std::back_inserter(missed));
      EXPECT_EQ(missed.size(), 0u) << "seed " << seed << ", dt " << dt;
    }
  }
}

// Candidates, their order and their gaps have the same bits for any number of threads.
TEST(ContactCandidates, AreTheSameForAnyNumberOfThreads) {
  const scene::Scene scene = crowd(20);
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  const VelocityState none = no_change(bodies);
  const auto names_and_gaps = [&] {
    ContactSet contacts;
    find_candidates(bodies, {}, frame / 20, none, contacts);
    std::vector<std::tuple<int, int, FeatureId, double>> all;
    for (const ContactPair& pair : contacts.pairs)
      for (int i = pair.begin; i < pair.end; ++i) {
        const ContactPoint& contact = contacts.points[static_cast<std::size_t>(i)];
        all.emplace_back(contact.host, contact.guest_rigid, contact.feature, contact.gap);
      }
    EXPECT_EQ(all.size(), contacts.points.size());
    return all;
  };
  set_thread_count(1);
  const auto alone = names_and_gaps();
  const double penetration = max_penetration(bodies, {});
  set_thread_count(3);
  EXPECT_EQ(names_and_gaps(), alone);
  EXPECT_EQ(max_penetration(bodies, {}), penetration);
  set_thread_count(0);
  EXPECT_GT(alone.size(), 1000u);
}

// The reported penetration is the largest over all samples, balls and surface points, by brute force.
TEST(ContactCandidates, DeepestPenetrationIsThatOfAllPoints) {
  for (unsigned seed = 30; seed < 32; ++seed) {
    const scene::Scene scene = crowd(seed);
    Simulation simulation(scene, test::plan(scene));
    const Bodies& bodies = simulation.world().bodies;
    double deepest = 0;
    for (std::size_t h = 0; h < bodies.rigid.size(); ++h) {
      const auto distance = [&](const Vec3& x) {
        return bodies.rigid.properties[h].shape.distance(bodies.rigid.state[h].pose.to_body(x));
      };
      for (std::size_t g = 0; g < bodies.rigid.size(); ++g) {
        const RigidProperties& guest = bodies.rigid.properties[g];
        if (g == h || (!bodies.rigid.properties[h].is_dynamic() && !guest.is_dynamic())) continue;
        const Pose& pose = bodies.rigid.state[g].pose;
        if (guest.shape.kind == LevelSet::Kind::sphere)
          deepest = std::min(deepest, distance(pose.position) - guest.shape.radius);
        for (const Vec3& sample : guest.samples) deepest = std::min(deepest, distance(pose.to_world(sample)));
      }
      for (const SurfacePoint& point : bodies.points)
        deepest = std::min(deepest, distance(weighted(point, bodies.particles.x)));
    }
    EXPECT_LT(deepest, -0.1);
    EXPECT_NEAR(max_penetration(bodies, {}), -deepest, 1e-13);  // rounding of the change of frames
  }
}

}  // namespace
}  // namespace duet::broad_phase_test
