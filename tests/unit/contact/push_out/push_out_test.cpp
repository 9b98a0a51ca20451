// Interpenetration resolution (Shinar et al. 2008, section 6.1): rows of heavy and light bodies (the
// messenger problem), wedges and slots.
#include "sim/contact/push_out/push_out.h"

#include <algorithm>
#include <cmath>

#include "tests/support/contacts.h"
#include "tests/support/margin.h"
#include <gtest/gtest.h>

#include "sim/contact/detection/max_penetration.h"

namespace duet::push_out_test {
namespace {

using test::ContactScene;
using test::expect_above;
using test::expect_below;

constexpr double overlap = 0.1;  // m: 5 % of the diameter of a ball

// Returns the deepest penetration of the scene, m.
double deepest(const ContactScene& scene) { return max_penetration(scene.bodies, {}); }

// Returns the center of mass of all particles and rigid bodies, m.
Vec3 center_of_mass(const Bodies& bodies) {
  Vec3 sum = Vec3::Zero();
  double mass = 0;
  for (std::size_t p = 0; p < bodies.particles.size(); ++p) {
    sum += bodies.particles.mass[p] * bodies.particles.x[p];
    mass += bodies.particles.mass[p];
  }
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    sum += bodies.rigid.properties[i].mass * bodies.rigid.state[i].pose.position;
    mass += bodies.rigid.properties[i].mass;
  }
  return sum / mass;
}

// Returns a row of balls with a radius of 1 m that overlap by 5 %: `light` balls of 1 kg between two of 1000
// kg.
scene::Scene row(int light) {
  scene::Scene scene = test::free_space();
  for (int i = 0; i < light + 2; ++i) {
    const bool is_heavy = i == 0 || i == light + 1;
    test::add_ball(scene, "ball" + std::to_string(i), Vec3((2 - overlap) * i, 0, 0), 1, is_heavy ? 1000 : 1);
  }
  return scene;
}

// Resolves the overlaps at one geometry and returns the number of sweeps that it took.
int push_out_once(ContactScene& scene, int sweeps = 10) {
  PushOutScratch scratch;
  const PushOutSettings settings{.iterations = 1, .sweeps = sweeps};
  return resolve_interpenetration(scene.bodies, scene.graph, settings, scene.contacts, scratch);
}

// Separates one pair of a row after the other by its overlap, in the inverse ratio of the masses, as a method
// to compare with. Returns the number of sweeps until no overlap exceeds the tolerance, at most `most`.
int pairwise_sweeps(ContactScene& scene, int most) {
  auto& rigid = scene.bodies.rigid;
  for (int sweep = 1; sweep <= most; ++sweep) {
    for (std::size_t i = 0; i + 1 < rigid.size(); ++i) {
      const Vec3 between = rigid.state[i + 1].pose.position - rigid.state[i].pose.position;
      const double missing = std::max(0.0, 2 - between.norm());
      const double a = rigid.properties[i].inverse_mass, b = rigid.properties[i + 1].inverse_mass;
      const Vec3 part = missing / (a + b) * between.normalized();
      displace(rigid.state[i], rigid.properties[i], -a * part, Vec3::Zero());
      displace(rigid.state[i + 1], rigid.properties[i + 1], b * part, Vec3::Zero());
    }
    if (deepest(scene) < overlap_tolerance) return sweep;
  }
  return most;
}

// A row of light balls between two heavy ones takes at most 1, 10 and 20 sweeps with central bodies, and at
// least ten times as many pair by pair, and the center of mass stays. If a central body saw its neighbors one
// after the other, the number of sweeps would grow with the mass ratio.
TEST(Interpenetration, MessengerRowsNeedTenTimesFewerSweeps) {
  for (const int light : {1, 3, 8}) {
    SCOPED_TRACE(light);
    ContactScene balls(row(light), 0.01);
    ContactScene pairs(row(light), 0.01);
    const Vec3 before = center_of_mass(balls.bodies);
    const int sweeps = push_out_once(balls, light > 3 ? 20 : 10);
    expect_below(deepest(balls), overlap_tolerance, "overlap left, m");
    EXPECT_LT((center_of_mass(balls.bodies) - before).norm(), 1e-13);
    const std::string name = std::to_string(light) + " light balls: ";
    expect_below(sweeps, light == 1 ? 1.5 : light == 3 ? 10.5 : 20.5, name + "sweeps");
    expect_above(pairwise_sweeps(pairs, 100 * sweeps), 10 * sweeps, name + "sweeps over pairs");
  }
}

// A particle is a central body as well: two heavy balls overlap the corner of a light soft box from both
// sides.
TEST(Interpenetration, AParticleBetweenHeavyBodiesIsCentralToo) {
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3(1, 1, 1), 1).mass = 1;
  for (const double side : {-1., 1.})  // they meet the upper right corner in the middle between them
    test::add_ball(scene, side < 0 ? "left" : "right", Vec3(0.5 + 0.98 * side, 0.5, 0.5), 1, 1000);
  ContactScene plates(scene, 0.01);
  const Vec3 before = center_of_mass(plates.bodies);
  const int sweeps = push_out_once(plates);
  expect_below(sweeps, 10.5, "sweeps");
  EXPECT_LT((center_of_mass(plates.bodies) - before).norm(), 1e-14);
  // The particle stays, because its mass is a thousandth of that of the balls, and the balls have separated
  // to leave room for it.
  const double between = plates.state(1).pose.position.x() - plates.state(0).pose.position.x();
  EXPECT_GT(between, 2 - 1e-5);
}

// A wide ball is 5 mm deep in the middle of an edge, and 0.01 mm at the ends of the edge, which come first in
// the list of contacts. One iteration opens the middle too, though it moves the same particles: the contacts
// of a pair are taken from the deepest on.
TEST(Interpenetration, WhatIsDeepestComesFirst) {
  constexpr double depth = 5e-3, at_ends = 1e-5, half_edge = 0.25;
  const double radius = (half_edge * half_edge + depth * depth) / (2 * (depth - at_ends));
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "soft", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 2);
  test::add_ball(scene, "ball", Vec3(half_edge, depth - radius, 0), radius, 1).is_static = true;
  scene.rigid.back().mass.reset();
  scene.solver.face_samples = 2;  // samples in the middles of edges
  ContactScene box(scene, 0.01);
  expect_above(deepest(box), 0.9 * depth, "overlap before");
  push_out_once(box);
  constexpr double contact_offset = 1e-3 * 2 * half_edge;  // m: depth that samples between vertices may keep
  expect_below(deepest(box), contact_offset + overlap_tolerance, "overlap after one iteration");
}

// Adds a static or kinematic wall of 6 x 1 x 4 m that is turned by `degrees` about z.
scene::RigidBody& add_wall(scene::Scene& scene, const std::string& name, const Vec3& position, double degrees,
                           bool is_kinematic) {
  scene::RigidBody& wall = test::add_box(scene, name, position, Vec3(6, 1, 4), 1);
  wall.placement.orientation = Quat(Eigen::AngleAxisd(degrees * EIGEN_PI / 180, Vec3::UnitZ()));
  wall.mass.reset();
  wall.is_static = !is_kinematic;
  wall.is_kinematic = is_kinematic;
  if (is_kinematic) wall.motion.spin.push_back({Vec3::UnitZ(), 0.01, 0, {}, 0});
  return wall;
}

// Returns the position of a wall whose face, with its normal at `degrees` from y, goes through the origin.
Vec3 below_face(double degrees, double half_thickness = 0.5) {
  const double a = degrees * EIGEN_PI / 180;
  return -half_thickness * Vec3(-std::sin(a), std::cos(a), 0);
}

// A ball is too deep in a wedge, with a heavy ball on it. It is lifted out of both walls at once, together
// with what it carries, and the walls stay, whether they are static or kinematic.
TEST(Interpenetration, LiftsARowOfBallsOutOfAWedge) {
  for (const bool is_kinematic : {false, true}) {
    scene::Scene scene = test::free_space();
    add_wall(scene, "left", below_face(-45), -45, is_kinematic);
    add_wall(scene, "right", below_face(45), 45, is_kinematic);
    const double seat = std::sqrt(2.0);  // m: height of a ball that touches both walls
    test::add_ball(scene, "low", Vec3(0, seat - 0.05, 0), 1, 1);
    test::add_ball(scene, "high", Vec3(0, seat + 1.9, 0), 1, 1000);
    ContactScene wedge(scene, 0.01);
    ASSERT_GT(deepest(wedge), 0.02);
    const Pose wall = wedge.state(0).pose;
    PushOutScratch scratch;
    resolve_interpenetration(wedge.bodies, wedge.graph, {.iterations = 6}, wedge.contacts, scratch);
    expect_below(deepest(wedge), 2 * overlap_tolerance, "overlap left in the wedge, m");
    EXPECT_EQ(wedge.state(0).pose.position, wall.position);
    EXPECT_EQ(wedge.state(0).pose.orientation.coeffs(), wall.orientation.coeffs());
    EXPECT_LT((wedge.state(2).pose.position - Vec3(0, seat, 0)).norm(), 1e-4);
  }
}

// Three balls are 5 % too deep between two walls that lean outward by 2 degrees each. They slide out upward
// in 30 steps.
TEST(Interpenetration, FreesBallsFromANarrowingSlot) {
  scene::Scene scene = test::free_space();
  for (const double side : {-1., 1.}) {
    const double degrees = side * 88;
    Vec3 place = below_face(degrees);
    place.x() += side * 0.93;
    add_wall(scene, side < 0 ? "left" : "right", place, degrees, side > 0);
  }
  for (int i = 0; i < 3; ++i)
    test::add_ball(scene, "ball" + std::to_string(i), Vec3(0, -1.5 + 2.3 * i, 0), 1, i == 1 ? 1 : 100);
  ContactScene slot(scene, 0.01);
  const double before = deepest(slot);
  ASSERT_GT(before, 0.03);
  for (int step = 0; step < 30; ++step) {
    PushOutScratch scratch;
    slot.find(0.01);
    resolve_interpenetration(slot.bodies, slot.graph, {.iterations = 10}, slot.contacts, scratch);
  }
  // The balls slide by a fraction of the remaining overlap at a time.
  expect_below(deepest(slot), 1e-5, "overlap left in the slot, m");
  for (std::size_t i = 2; i < 5; ++i) {
    EXPECT_TRUE(slot.state(i).pose.position.allFinite());
    EXPECT_LT(std::abs(slot.state(i).pose.position.x()), 1.5) << "between the walls";
  }
}

// A pile on the ground is lifted by all orders of the central bodies: together, or level by level with the
// lower bodies held. Only the order `levels`, in which lower bodies are not held, leaves more: it carries
// heavy bodies no better than pairs do.
TEST(Interpenetration, EveryOrderLiftsAPileOffTheGround) {
  for (const PushOutOrder order :
       {PushOutOrder::together, PushOutOrder::levels, PushOutOrder::frozen_levels}) {
    scene::Scene scene = test::on_ground();
    for (int i = 0; i < 4; ++i)
      test::add_ball(scene, "ball" + std::to_string(i), Vec3(0, 0.99 + 1.98 * i, 0), 1, i % 2 ? 1000 : 1);
    ContactScene pile(scene, 0.01);
    PushOutScratch scratch;
    const PushOutSettings settings{.iterations = 8, .gradual = false, .order = order};
    const int sweeps = resolve_interpenetration(pile.bodies, pile.graph, settings, pile.contacts, scratch);
    test::record_margin("sweeps", sweeps, "");
    if (order != PushOutOrder::levels) {  // this one carries heavy bodies no better than pairs do
      EXPECT_LT(deepest(pile), 2 * overlap_tolerance);
    }
    EXPECT_LT(deepest(pile), 0.02) << "no deeper than at first";
  }
}

// Gradual iterations remove 2/5, 4/5 and then all of the overlaps; either way nothing is left after four
// iterations.
TEST(Interpenetration, GradualIterationsRemoveGrowingFractions) {
  for (const bool gradual : {true, false}) {
    ContactScene pair(row(0), 0.01);
    PushOutScratch scratch;
    resolve_interpenetration(pair.bodies, pair.graph, {.iterations = 4, .gradual = gradual}, pair.contacts,
                             scratch);
    EXPECT_LT(deepest(pair), overlap_tolerance);
    ContactScene once(row(0), 0.01);
    // The system of one geometry opens 0.4 of the overlap, in one sweep, and marks both bodies as moved.
    PushOutSystem system;
    std::vector<char> moved(2, 0);
    system.begin(once.bodies, {});
    ContactPoint& contact = once.contacts.points.front();
    update_geometry(once.bodies, contact);
    system.add(contact, 1, -0.4 * contact.gap * contact.normal);
    system.factor({0, 1});
    EXPECT_EQ(system.solve(1e-9, 10), 1);
    system.apply(once.bodies, moved);
    EXPECT_NEAR(deepest(once), 0.6 * overlap, 1e-12);
    EXPECT_EQ(moved, (std::vector<char>{1, 1}));
  }
}

// An overlap that a deformable body has had since the start of the scene decreases in each step by a 32nd of
// itself, and by at most a hundredth of an element. One that is below a thousandth of an element is removed
// at once. The law is relative to the element size, so it holds from 1 mm to 1 km.
TEST(Interpenetration, OverlapsFromTheStartOpenGradually) {
  for (const double size : {1e-3, 1.0, 1e3}) {
    EXPECT_EQ(overlap_kept(-0.1 * size, size), 0);
    EXPECT_EQ(overlap_kept(1e-3 * size, size), 0);
    double depth = size;
    int steps = 0;
    for (; depth > 1e-3 * size; ++steps) {
      const double kept = overlap_kept(depth, size);
      EXPECT_LT(kept, depth);
      EXPECT_LE(depth - kept, 0.01001 * size);
      EXPECT_LE(depth - kept, depth / 31);
      depth = kept;
    }
    EXPECT_LE(steps, 250) << "68 steps of a hundredth down to 0.32, and ln 320 / ln(32 / 31) from there";
  }
}

}  // namespace
}  // namespace duet::push_out_test
