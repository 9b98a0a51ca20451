#include "sim/simulation/drawn_overlap.h"

#include <memory>

#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/geometry/mesh/triangle_mesh.h"
#include "sim/simulation/overlaps.h"

namespace duet::drawn_overlap_test {
namespace {

constexpr double reach = 0.6;  // m, from the center of the octahedron to its corners

// Adds a soft box of 1 m whose drawn surface is an octahedron that reaches 0.1 m out of each of its faces.
scene::DeformableBody& add_octahedron(scene::Scene& scene, const Vec3& position, bool contact) {
  scene::DeformableBody& body = test::add_soft_box(scene, "soft", position, Vec3(1, 1, 1), 2);
  TriangleMesh mesh;
  mesh.positions = {{reach, 0, 0},  {-reach, 0, 0}, {0, reach, 0},
                    {0, -reach, 0}, {0, 0, reach},  {0, 0, -reach}};
  mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  body.skin.emplace();
  body.skin->mesh_file = "octahedron.obj";
  body.skin->mesh = std::make_shared<const TriangleMesh>(std::move(mesh));
  body.skin->contact = contact;
  return body;
}

FrameStats stats_of(const scene::Scene& scene) { return Simulation(scene, test::plan(scene)).stats(); }

// The box hangs 1 cm above the ground, and a corner of its drawn surface 9 cm below it. What touches does not
// overlap, and the drawn depth is the same for the statistics and for the search at any spacing.
TEST(DrawnOverlap, IsThatOfTheSurfaceThatIsDrawn) {
  scene::Scene scene = test::on_ground();
  add_octahedron(scene, Vec3(0.3, 0.51, -2), false);
  const Simulation simulation(scene, test::plan(scene));
  const FrameStats stats = simulation.stats();
  EXPECT_EQ(stats.max_penetration, 0);
  ASSERT_TRUE(stats.drawn_overlap);
  EXPECT_EQ(stats.drawn_overlap->guest, "soft");
  EXPECT_EQ(stats.drawn_overlap->host, "ground");
  EXPECT_NEAR(stats.drawn_overlap->depth, 0.09, 1e-7);  // the drawn surface has single precision at rest
  EXPECT_LT((stats.drawn_overlap->place - Vec3(0.3, -0.09, -2)).norm(), 1e-7);
  const Overlaps found = find_overlaps(simulation, 0.05);
  EXPECT_EQ(found.deformable.depth, 0);
  ASSERT_TRUE(found.drawn);
  EXPECT_EQ(found.drawn->depth, stats.drawn_overlap->depth);
}

// Surfaces that are drawn and touch have no second depth: max_penetration is theirs.
TEST(DrawnOverlap, IsEmptyIfWhatIsDrawnTouches) {
  scene::Scene skin = test::on_ground();
  add_octahedron(skin, Vec3(0, 0.51, 0), true);
  const FrameStats stats = stats_of(skin);
  EXPECT_FALSE(stats.drawn_overlap);
  EXPECT_NEAR(stats.max_penetration, 0.09, 1e-7);
  const Overlaps found = find_overlaps(Simulation(skin, test::plan(skin)), 0.05);
  EXPECT_FALSE(found.drawn);
  EXPECT_NEAR(found.deformable.depth, 0.09, 1e-7);
  scene::Scene plain = test::on_ground();
  test::add_soft_box(plain, "soft", Vec3(0, 0.4, 0), Vec3(1, 1, 1), 2);
  EXPECT_FALSE(stats_of(plain).drawn_overlap);
}

// A ball of 5 cm lies 1 cm deep in the middle of a face of 0.85 m, far from its corners. Within a spacing of
// s the search finds its deepest point to s^2 / (2 r).
TEST(DrawnOverlap, IsSeenBetweenTheCornersOfTriangles) {
  scene::Scene scene = test::free_space();
  add_octahedron(scene, Vec3::Zero(), false);
  const double outward = reach / std::sqrt(3.0) + 0.04;
  test::add_ball(scene, "ball", outward * Vec3(1, 1, 1).normalized(), 0.05, 1);
  const Simulation simulation(scene, test::plan(scene));
  const std::optional<DeepestOverlap> fine = simulation.drawn_overlap(0.005);
  ASSERT_TRUE(fine);
  EXPECT_EQ(fine->host, "ball");
  EXPECT_NEAR(fine->depth, 0.01, 0.005 * 0.005 / 0.1);
  ASSERT_TRUE(simulation.stats().drawn_overlap);
  EXPECT_GT(simulation.stats().drawn_overlap->depth, 0);
}

// Bones lie in their flesh on purpose, and so does what holds a body whose particles are all pinned.
TEST(DrawnOverlap, LeavesOutBonesAndWhatNoForceMoves) {
  scene::Scene bone = test::free_space();
  add_octahedron(bone, Vec3::Zero(), false).attach = {"bone"};
  test::add_ball(bone, "bone", Vec3::Zero(), 0.3, 1);
  ASSERT_TRUE(stats_of(bone).drawn_overlap);
  EXPECT_EQ(stats_of(bone).drawn_overlap->depth, 0);
  scene::Scene pinned = test::on_ground();
  scene::DeformableBody& body = add_octahedron(pinned, Vec3(0, 0.51, 0), false);
  EXPECT_GT(stats_of(pinned).drawn_overlap->depth, 0);
  body.pins.push_back({Vec3::Zero(), {}, 2, {}});
  EXPECT_EQ(stats_of(pinned).drawn_overlap->depth, 0);
}

}  // namespace
}  // namespace duet::drawn_overlap_test
