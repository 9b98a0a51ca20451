// Contact of deformable bodies with each other and with themselves.
#include <algorithm>

#include "tests/support/full.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/base/parallel.h"
#include "sim/step/step.h"

namespace duet::self_contact_test {
namespace {

// Returns the calls of a stage so far.
const StageClock::Entry& calls_of(const Simulation& simulation, Stage stage) {
  return simulation.world().clock[stage];
}

// Returns a soft box that is dropped on another one, off its middle and with vertices that do not match.
scene::Scene two_boxes(double drop = 0.06) {
  scene::Scene scene = test::on_ground(0.5);
  test::add_soft_box(scene, "lower", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 2);
  test::add_soft_box(scene, "upper", Vec3(0.02, 1.5 + drop, 0.03), Vec3(1, 1, 1), 3);
  return scene;
}

// The upper box comes to rest on the lower one without intersections. Bounds are measurements with a margin,
// where no comment derives them.
TEST(SelfContact, OneSoftBoxStandsOnAnother) {
  const scene::Scene scene = two_boxes();
  Simulation simulation(scene, test::plan(scene));
  const auto settle = [&](int frames) {
    for (int i = 0; i < frames; ++i) {
      simulation.advance_frame();
      ASSERT_EQ(simulation.stats().self_intersections, 0);
    }
  };
  settle(72);
  const Vec3 before = test::center_of(simulation.world().bodies, 1);
  settle(48);
  const Vec3 after = test::center_of(simulation.world().bodies, 1);
  EXPECT_LT((after - before).norm(), 2e-3) << "the sway of the fall is still dying down";
  // The surfaces keep about their thickness as distance, which is a tenth of the shortest edge (1/3 m and
  // 1/2 m).
  const double gap = 0.1 * (1.0 / 3 + 1.0 / 2) / 2;
  EXPECT_NEAR(after.y(), 1.5 + gap, 0.6 * gap);
  EXPECT_LT(simulation.stats().kinetic, 0.1) << "of 9800 J per meter";
  EXPECT_GT(simulation.stats().self_repulsions, 0);
}

// Repulsions must not hold surfaces together: a box that is thrown up leaves as in free flight.
TEST(SelfContact, WhatTouchedPartsFreely) {
  const scene::Scene scene = two_boxes();
  Simulation simulation(scene, test::plan(scene));
  for (int i = 0; i < 48; ++i) simulation.advance_frame();
  World& world = simulation.world();
  const DeformableBody& upper = world.bodies.deformable[1];
  for (int i = 0; i < upper.particle_count; ++i)
    world.bodies.particles.v[static_cast<std::size_t>(upper.first_particle + i)] = Vec3(0, 2, 0);
  const double start = test::center_of(simulation.world().bodies, 1).y();
  simulation.advance_frame();
  // The upper box flies freely, except for the push of the lower one as it springs back.
  const double flight = 2.0 / 24 - 0.5 * 9.8 / 24 / 24;
  EXPECT_NEAR(test::center_of(simulation.world().bodies, 1).y() - start, flight, 0.05 * flight);
}

// Returns two boxes that hit each other off their centers, each at `speed` (m/s).
scene::Scene crash(double speed) {
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "a", Vec3(-0.7, 0, 0), Vec3(1, 1, 1), 3).placement.velocity = Vec3(speed, 0, 0);
  scene::DeformableBody& b = test::add_soft_box(scene, "b", Vec3(0.7, 0.3, 0.2), Vec3(1, 1, 1), 3);
  b.placement.velocity = Vec3(-speed, 0, 0);
  b.placement.angular_velocity = Vec3(1, 2, 3);
  return scene;
}

// Linear momentum is kept to rounding, and kinetic plus elastic energy never exceeds the start. At the higher
// speed collisions must act, not only repulsions.
TEST(SelfContact, ACrashKeepsMomentumAndCreatesNoEnergy) {
  for (const double speed : {3.0, 30.0}) {
    const scene::Scene scene = crash(speed);
    Simulation simulation(scene, test::plan(scene));
    simulation.world().ledger.turn_on();
    const FrameStats start = simulation.stats();
    std::int64_t collisions = 0;
    for (int i = 0; i < 4; ++i) {
      simulation.advance_frame();
      const FrameStats now = simulation.stats();
      ASSERT_EQ(now.self_intersections, 0);
      EXPECT_LT((now.momentum - start.momentum).norm(), 1e-10 * 2000 * speed);
      // Repulsions keep angular momentum to rounding. Impulses of collisions act where surfaces meet within
      // the step, which leaves a moment of second order in the step, as moving positions with the velocity of
      // the middle of the step does.
      const double scale = 2000 * speed;  // kg m/s, of all masses, at a meter from the middle
      for (const Stage stage : {Stage::self_repulsion, Stage::repulsion_at_end})
        EXPECT_LT(simulation.world().ledger[stage].angular_defect, 1e-12 * scale);
      EXPECT_LT(simulation.world().ledger[Stage::self_collision].angular_defect, 2e-3 * scale);
      EXPECT_LT(now.kinetic + now.elastic, start.kinetic);
      collisions += now.self_collisions;
    }
    EXPECT_GT(
        test::center_of(simulation.world().bodies, 1).x() - test::center_of(simulation.world().bodies, 0).x(),
        1);
    if (speed > 10) {
      EXPECT_GT(collisions, 0) << "faster than a thickness a step: repulsions come too late";
    }
  }
}

// Returns a thin sheet on its edge that falls into folds on the ground.
scene::Scene falling_sheet() {
  scene::Scene scene = test::on_ground(0.5);
  scene::DeformableBody& sheet =
      test::add_soft_box(scene, "sheet", Vec3(0, 0.62, 0), Vec3(0.03, 1.2, 0.15), 1, 1e4);
  sheet.shape.cells = Vec3i(1, 24, 3);
  sheet.self_collision = true;
  sheet.placement.velocity = Vec3(0, -3, 0);
  sheet.placement.angular_velocity = Vec3(0, 0, 0.3);
  return scene;
}

// No two triangles of the sheet intersect at the end of a frame while it folds. Without the two effects the
// result must differ, and intersections are not counted.
TEST(SelfContact, ASheetFoldsWithoutCrossingItself) {
  const scene::Scene scene = falling_sheet();
  Simulation simulation(scene, test::plan(scene));
  std::int64_t touches = 0;
  for (int i = 0; i < 16; ++i) {
    simulation.advance_frame();
    ASSERT_EQ(simulation.stats().self_intersections, 0) << "frame " << i + 1;
    touches += simulation.stats().self_repulsions + simulation.stats().self_collisions;
  }
  EXPECT_GT(touches, 0);
  Simulation without(scene, scene::plan_effects(scene, {"self_repulsion", "self_collision"}).active());
  for (int i = 0; i < 16; ++i) without.advance_frame();
  EXPECT_FALSE(without.stats().self_intersections);
  EXPECT_NE(without.stats().hash, simulation.stats().hash);
}

// The number of threads must not change any bit.
TEST(SelfContact, ResultsDoNotDependOnThreads) {
  const scene::Scene scene = falling_sheet();
  std::vector<std::uint64_t> hashes;
  for (const int threads : {1, 3}) {
    set_thread_count(threads);
    Simulation simulation(scene, test::plan(scene));
    for (int i = 0; i < 6; ++i) simulation.advance_frame();
    hashes.push_back(simulation.stats().hash);
  }
  set_thread_count(0);
  EXPECT_EQ(hashes[0], hashes[1]);
}

// A resumed run has searched for its pairs at other times, and must still have the same bits.
TEST(SelfContact, AResumedRunGoesOnBitIdentically) {
  const scene::Scene scene = falling_sheet();
  Simulation whole(scene, test::plan(scene)), resumed(scene, test::plan(scene));
  for (int i = 0; i < 5; ++i) whole.advance_frame();
  resumed.load_state(whole.save_state());
  for (int i = 0; i < 3; ++i) {
    whole.advance_frame();
    resumed.advance_frame();
    EXPECT_EQ(whole.stats().hash, resumed.stats().hash);
  }
}

// Self-contact must not change any bit of bodies that do not touch.
TEST(SelfContact, BodiesThatStayApartAreNotTouchedByIt) {
  const scene::Scene scene = two_boxes(3);
  Simulation with(scene, test::plan(scene));
  Simulation without(scene, scene::plan_effects(scene, {"self_repulsion", "self_collision"}).active());
  for (int i = 0; i < 4; ++i) {
    with.advance_frame();
    without.advance_frame();
  }
  const std::vector<BodyHashes> hashes = with.state_hashes(), others = without.state_hashes();
  ASSERT_EQ(hashes.size(), others.size());
  for (std::size_t i = 0; i < hashes.size(); ++i) {
    ASSERT_EQ(hashes[i].quantities.size(), others[i].quantities.size());
    for (std::size_t k = 0; k < hashes[i].quantities.size(); ++k)
      EXPECT_EQ(hashes[i].quantities[k].hash, others[i].quantities[k].hash)
          << hashes[i].name << ": " << hashes[i].quantities[k].name;
  }
  EXPECT_GT(calls_of(with, Stage::self_collision).calls, 0);
  EXPECT_EQ(calls_of(without, Stage::self_collision).calls, 0);
  EXPECT_EQ(calls_of(without, Stage::self_repulsion).calls, 0);
  EXPECT_EQ(calls_of(without, Stage::repulsion_at_end).calls, 0);
}

// Two bodies that only touch are as much of a problem as overlapping ones, because rounding decides on which
// side of each other they are. They are separated, or refused with an error that names both.
TEST(SelfContact, BodiesThatMeetAtTheStartArePartedOrRefused) {
  test::Cases cases(2);  // 2 of 3
  for (const double gap : {1e-12, 0.0, -0.1}) {
    if (!cases.takes()) continue;
    scene::Scene scene = two_boxes(gap);
    Simulation parted(scene, test::plan(scene));
    ASSERT_EQ(parted.initial_overlaps().size(), 1U);
    EXPECT_NEAR(parted.initial_overlaps().front().depth, std::max(0.0, -gap), 1e-9);
    parted.advance_frame();
    EXPECT_EQ(parted.stats().self_intersections, 0);
    scene.solver.initial_overlap = scene::OverlapPolicy::refuse;
    try {
      const Simulation simulation(scene, test::plan(scene));
      FAIL() << gap;
    } catch (const SceneError& error) {
      const std::string text = error.problems().front().text();
      EXPECT_NE(text.find("`lower`"), std::string::npos) << text;
      EXPECT_NE(text.find("`upper`"), std::string::npos) << text;
      EXPECT_NE(text.find("move them apart"), std::string::npos) << text;
    }
  }
  const scene::Scene scene = two_boxes(-0.1);
  const Simulation passing(scene, scene::plan_effects(scene, {"self_repulsion", "self_collision"}).active());
}

}  // namespace
}  // namespace duet::self_contact_test
