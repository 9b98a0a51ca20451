#include "sim/simulation/overlaps.h"

#include "tests/support/scenes.h"
#include <gtest/gtest.h>

namespace duet::overlaps_test {
namespace {

// Expects the names of the deepest overlap and its depth to within `tolerance` (m).
void expect_overlap(const DeepestOverlap& overlap, const std::string& guest, const std::string& host,
                    double depth, double tolerance) {
  EXPECT_EQ(overlap.guest, guest);
  EXPECT_EQ(overlap.host, host);
  EXPECT_NEAR(overlap.depth, depth, tolerance);
}

// A ball is 3 mm deep in the face of a block, and two blocks are 5 mm apart and then overlap by 5 mm. A
// lattice of 1 cm misses the ball's lowest point by up to 5 mm, which costs (5 mm)^2 / (2 m) of depth.
TEST(Overlaps, OfRigidBodiesAreTheDeepestOfAllPairs) {
  scene::Scene scene = test::free_space();
  test::add_box(scene, "block", Vec3(0, -1, 0), Vec3(4, 2, 4), 1);
  test::add_ball(scene, "ball", Vec3(0.123, 0.997, 0.2), 1, 1);
  test::add_box(scene, "other", Vec3(3.005, -1, 0.3), Vec3(2, 1, 1), 1);
  expect_overlap(find_overlaps(Simulation(scene, test::plan(scene)), 0.01).rigid, "ball", "block", 0.003,
                 2e-5);
  scene.rigid.back().placement.position.x() = 2.995;
  const Overlaps found = find_overlaps(Simulation(scene, test::plan(scene)), 0.01);
  EXPECT_NEAR(found.rigid.depth, 0.005, 1e-7);  // precision of single-precision surfaces
  EXPECT_NEAR(found.rigid.place.x(), 2, 0.0051);
  EXPECT_EQ(found.deformable.depth, 0);
  EXPECT_EQ(found.deformable.guest, "");
}

// The overlaps are seen in places without surface points: a small ball sinks into the middle of a face of a
// soft block of one cell, and the block sinks, by a little less, into the ground with a whole face.
TEST(Overlaps, OfDeformableBodiesAreSeenBetweenTheirPoints) {
  scene::Scene scene = test::on_ground();
  scene.solver.face_samples = 0;
  test::add_soft_box(scene, "soft", Vec3(0, 0.498, 0), Vec3(1, 1, 1), 1);
  test::add_ball(scene, "ball", Vec3(0.3, 1.045, -0.1), 0.05, 1);
  const Overlaps found = find_overlaps(Simulation(scene, test::plan(scene)), 0.002);
  expect_overlap(found.deformable, "soft", "ball", 0.003, 4e-5);  // (2 mm)^2 / (2 * 5 cm)
  EXPECT_LT((found.deformable.place - Vec3(0.3, 0.998, -0.1)).norm(), 0.003);
  EXPECT_EQ(found.rigid.depth, 0);
  scene.rigid.clear();
  expect_overlap(find_overlaps(Simulation(scene, test::plan(scene)), 0.1).deformable, "soft", "ground", 0.002,
                 1e-9);
}

// Shells and rods extend by half of their thickness around their middle surface or line, which is where they
// are sampled.
TEST(Overlaps, OfShellsAndRodsCountTheirThickness) {
  for (const bool is_shell : {true, false}) {
    scene::Scene scene = test::on_ground();
    scene::DeformableBody& body = test::add_soft_box(scene, "thin", Vec3(0, 0.013, 0), Vec3(1, 1, 1), 1);
    body.thickness = 0.03;
    if (is_shell) {
      body.shape.kind = scene::DeformableKind::panel;
      body.shape.panel_size = Vec2(1, 1);
    } else {
      body.shape.kind = scene::DeformableKind::rod;
      body.shape.points = {Vec3(-0.5, 0, 0), Vec3(0, 0, 0.1), Vec3(0.5, 0, 0)};
    }
    const Overlaps found = find_overlaps(Simulation(scene, test::plan(scene)), 0.1);
    expect_overlap(found.deformable, "thin", "ground", 0.002, 1e-9);
  }
}

}  // namespace
}  // namespace duet::overlaps_test
