// Contact with jointed bodies uses the articulated response: loads feel the joints, not the masses of single
// bodies.
#include <algorithm>
#include <cmath>

#include "tests/support/articulated.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/base/parallel.h"
#include "sim/contact/detection/contact_candidates.h"
#include "sim/contact/detection/max_penetration.h"
#include "sim/step/world.h"

namespace duet::linked_contact_test {
namespace {

// Returns the height (m) of the center of mass of a load of 1 m and 1000 kg, two seconds after it was put on
// a plate of `mass` (kg) that is welded to a static post. A plate without mass is static itself.
double height_on_plate(double mass, bool is_soft,
                       scene::VelocityConstraints order = scene::VelocityConstraints::after_solve) {
  scene::Scene scene = test::free_space();
  scene.solver.velocity_constraints = order;
  scene.gravity = Vec3(0, -9.8, 0);
  scene::RigidBody& post = test::add_box(scene, "post", Vec3(0, -3, 0), Vec3(1, 1, 1), 1);
  post.mass.reset();
  post.is_static = true;
  scene::RigidBody& plate = test::add_box(scene, "plate", Vec3(0, -0.1, 0), Vec3(3, 0.2, 3), mass);
  if (mass == 0) {
    plate.mass.reset();
    plate.is_static = true;
  } else {
    scene::Joint weld;
    weld.name = "weld";
    weld.type = scene::JointType::weld;
    weld.parent = "post";
    weld.child = "plate";
    weld.world.position = Vec3(0, -1, 0);
    scene.joints.push_back(weld);
  }
  if (is_soft) {
    test::add_soft_box(scene, "load", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 3, 2e5);
    scene.materials.back().damping = 0.1;
  } else {
    test::add_box(scene, "load", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 1000);
  }
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 48; ++frame) simulation.advance_frame();
  const Bodies& bodies = simulation.world().bodies;
  if (!is_soft) return bodies.rigid.state.back().pose.position.y();
  double height = 0, sum = 0;
  for (std::size_t p = 0; p < bodies.particles.size(); ++p) {
    height += bodies.particles.mass[p] * bodies.particles.x[p].y();
    sum += bodies.particles.mass[p];
  }
  return height / sum;
}

// A plate that is welded to a static body carries a load as that body does, whatever its mass, to 1e-5 m.
// When contact and joints were solved in turn, the soft load sank in by 20 mm on a plate of 10 kg, and fell
// through that of 0.1 kg.
TEST(LinkedContact, AWeldedPlateBearsLikeAWall) {
  for (const bool is_soft : {true, false}) {
    const double on_wall = height_on_plate(0, is_soft);
    for (const double mass : {1000.0, 10.0, 0.1})
      test::expect_below(std::abs(height_on_plate(mass, is_soft) - on_wall), 1e-5,
                         is_soft ? "soft load, m" : "rigid load, m");
  }
}

// A welded plate carries a load to 1e-5 m with contact before the solve as well. In that order the plate once
// responded with its joints but was pushed as a free body.
TEST(LinkedContact, AWeldedPlateBearsWithConstraintsFirst) {
  const scene::VelocityConstraints order = scene::VelocityConstraints::before_solve;
  const double on_wall = height_on_plate(0, true, order);
  for (const double mass : {1000.0, 10.0, 0.1})
    test::expect_below(std::abs(height_on_plate(mass, true, order) - on_wall), 1e-5, "soft load, m");
}

// Rings of six links collapse onto themselves and each other. Their contacts must reach the target velocities
// while the joints hold, up to the tolerance of the sweeps. When contact and joints were solved in turn,
// 10 mm/s of approach were left.
TEST(LinkedContact, FoldedLoopsKeepTheirContacts) {
  scene::Scene scene = test::on_ground(0.4);
  scene.gravity = Vec3(0, -9.8, 0);
  for (int loop = 0; loop < 3; ++loop) {
    scene::Scene one;
    test::add_loop(one, 6, scene::JointType::point, Vec3(0.4 * loop, 1.2, 0.3 * loop));
    for (scene::RigidBody& link : one.rigid) {
      link.name += "_" + std::to_string(loop);
      scene.rigid.push_back(link);
    }
    for (scene::Joint& joint : one.joints) {
      joint.name += "_" + std::to_string(loop);
      joint.parent += "_" + std::to_string(loop);
      joint.child += "_" + std::to_string(loop);
      scene.joints.push_back(joint);
    }
  }
  Simulation simulation(scene, test::plan(scene));
  const World& world = simulation.world();
  double left = 0;
  int contacts = 0;
  bool touch_themselves = false;
  for (int frame = 0; frame < 60; ++frame) {
    simulation.advance_frame();
    for (const ContactPoint& contact : world.context.contact.contacts.points) {
      if (contact.impulse.isZero(0)) continue;
      const double normal_velocity = relative_velocity(world.bodies, contact).dot(contact.normal);
      left += std::max(contact.target - normal_velocity, 0.0);
      ++contacts;
      touch_themselves |= contact.host / 6 == contact.guest_rigid / 6 && contact.host < 18;
    }
  }
  EXPECT_TRUE(touch_themselves);
  test::expect_below(left / contacts, 2e-4, "approach left in the mean, m/s");
  test::expect_below(simulation.stats().max_penetration, 1e-5, "penetration, m");
}

// A loop of six links lies flat, three beside three. Its two middle links overlap by 2 mm, and the others
// weigh a hundred times as much. When interpenetration resolution moved the two by themselves, the joints
// undid it in every step, and loops that were wedged in a pile sank into themselves by 26 mm and more.
TEST(LinkedContact, WhatOverlapsInALoopParts) {
  scene::Scene scene = test::free_space();
  scene.fps = 24;
  const double side = 0.049;
  for (int i = 0; i < 6; ++i) {
    const bool upper = i < 3;
    test::add_box(scene, "link" + std::to_string(i), Vec3(upper ? i - 1 : 4 - i, upper ? side : -side, 0),
                  Vec3(0.9, 0.1, 0.1), i % 3 == 1 ? 10 : 1000);
  }
  const Vec3 places[] = {{-0.5, side, 0}, {0.5, side, 0},   {1.5, 0, 0},
                         {0.5, -side, 0}, {-0.5, -side, 0}, {-1.5, 0, 0}};
  for (int i = 0; i < 6; ++i)
    test::add_joint(scene, scene::JointType::point, "link" + std::to_string(i),
                    "link" + std::to_string((i + 1) % 6), places[i]);
  Simulation simulation(scene, test::plan(scene));
  EXPECT_NEAR(max_penetration(simulation.world().bodies, {}), 0.1 - 2 * side, 1e-12);
  simulation.advance_frame();
  test::expect_below(simulation.stats().max_penetration, 1e-5, "penetration, m");
}

// Threads share the pairs of a heap of chains of three bodies, in which a visit to one body changes the
// others. The coloring of pairs must keep such pairs apart.
TEST(LinkedContact, AHeapHasTheSameBitsForAnyNumberOfThreads) {
  std::vector<std::uint64_t> hashes;
  const int frames = test::runs_in_full() ? 8 : 5;
  test::Cases cases(2);  // 2 of 3
  for (const int threads : {1, 2, 3}) {
    if (!cases.takes()) continue;
    set_thread_count(threads);
    scene::Scene scene = test::on_ground(0.4);
    for (int n = 0; n < 24; ++n) {
      const int row = n / 4;
      const Vec3 place(row % 2 * 0.4, 0.11 + row * 0.25, n % 4 * 0.21);
      for (int i = 0; i < 3; ++i)
        test::add_box(scene, "part" + std::to_string(3 * n + i), place + Vec3(i, 0, 0), Vec3(0.95, 0.2, 0.2),
                      i == 1 ? 1 : 20);
      for (int i = 0; i < 2; ++i) {
        scene::Joint joint;
        joint.name = "joint" + std::to_string(2 * n + i);
        joint.parent = "part" + std::to_string(3 * n + i);
        joint.child = "part" + std::to_string(3 * n + i + 1);
        joint.world.position = place + Vec3(i + 0.5, 0, 0);
        scene.joints.push_back(joint);
      }
    }
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 0; frame < frames; ++frame) simulation.advance_frame();
    EXPECT_GT(simulation.world().context.contact.contacts.pairs.size(), 64u);  // else one thread has them all
    test::expect_below(simulation.stats().max_penetration, 0.002, "penetration, m");
    hashes.push_back(simulation.stats().hash);
  }
  set_thread_count(0);
  for (const std::uint64_t hash : hashes) EXPECT_EQ(hash, hashes[0]);
}

}  // namespace
}  // namespace duet::linked_contact_test
