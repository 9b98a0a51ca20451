// The scenes of cloth, knots and links, coarser than they ship: no deformable body passes through itself or
// others.
#include <algorithm>

#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/places.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/geometry/queries/continuous_collision.h"
#include "sim/scene/reader/reader.h"
#include "sim/step/world.h"

namespace duet::folding_test {
namespace {

// Returns a scene of scenes/hard.
scene::Scene hard_scene(const std::string& name) {
  return scene::read(test::source_folder() + "/scenes/hard/" + name + ".toml").scene;
}

// Returns the smallest distance (m) of two segments of a rod that are at least `apart` segments apart.
double min_gap(const Bodies& bodies, std::size_t apart) {
  double least = 1;
  const std::vector<Vec3>& x = bodies.particles.x;
  const auto at = [&](int p) { return x[static_cast<std::size_t>(p)]; };
  for (std::size_t i = 0; i < bodies.segments.size(); ++i)
    for (std::size_t j = i + apart; j < bodies.segments.size(); ++j) {
      const auto &a = bodies.segments[i], &b = bodies.segments[j];
      const FourPoints points{at(a[0]), at(a[1]), at(b[0]), at(b[1])};
      least = std::min(least, closest_points(ElementPair::edge_edge, points).difference.norm());
    }
  return least;
}

// Returns the smallest distance (m) of the strands of the knot within 120 frames, without the effects of the
// list. It looks no further once that is below `enough` (m).
double min_gap_on_the_way(const std::vector<std::string>& without, double enough) {
  scene::Scene scene = hard_scene("knotted_rope");
  scene.deformable[0].shape.segments = 64;
  Simulation simulation(scene, scene::plan_effects(scene, without).active());
  double least = 1;
  while (simulation.frame() < 120 && least >= enough) {
    simulation.advance_frame();
    least = std::min(least, min_gap(simulation.world().bodies, 6));
  }
  return least;
}

// Hands pull the knot tight, so that strands lie a diameter apart, to 1 %. Without repulsions and collisions
// they pass through each other, which shows that the test can fail.
TEST(Folding, ARopeThatIsKnottedKeepsItsStrandsADiameterApart) {
  const double diameter = *hard_scene("knotted_rope").deformable[0].thickness;
  const double gap = min_gap_on_the_way({}, 0) / diameter;
  test::expect_above(gap, 0.99, "least distance of the strands over the diameter");
  EXPECT_LT(gap, 1.01);
  EXPECT_LT(min_gap_on_the_way({"self_repulsion", "self_collision"}, 0.5 * diameter), 0.5 * diameter);
}

// No two triangles of the cloth may intersect at the end of a frame, while it folds.
TEST(Folding, AClothOnABallAndASpikeDoesNotCrossItself) {
  scene::Scene scene = hard_scene("cloth");
  if (test::runs_in_full())
    scene.deformable[0].shape.panel_cells = {28, 27};
  else
    scene.deformable[0].shape.panel_cells = {20, 19};
  Simulation simulation(scene, test::plan(scene));
  std::int64_t touches = 0;
  for (int frame = 1; frame <= 36; ++frame) {
    simulation.advance_frame();
    ASSERT_EQ(simulation.stats().self_intersections, 0) << "frame " << frame;
    // The bound is a twentieth of the edges of this coarse cloth, whose samples the tip of the spike slips
    // between. At the shipped size the penetration is 0.05 mm.
    EXPECT_LT(simulation.stats().max_penetration, 4e-3);
    touches += simulation.stats().self_repulsions;
  }
  EXPECT_GT(touches, 10) << "it folds";
}

// Two linked soft rings do not come apart, and none of their elements is inverted.
TEST(Folding, RingsStayLinked) {
  scene::Scene scene = hard_scene("linked_rings");
  for (scene::DeformableBody& ring : scene.deformable)
    ring.shape.spacing = test::runs_in_full() ? 0.14 : 0.18;
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 1; frame <= 48; ++frame) {
    simulation.advance_frame();
    ASSERT_EQ(simulation.stats().self_intersections, 0) << "frame " << frame;
    ASSERT_EQ(simulation.stats().inverted, 0) << "frame " << frame;
  }
  // The lower ring hangs from the upper one. Had it come loose, it would lie on the ground, 0.15 m high.
  const Bodies& bodies = simulation.world().bodies;
  double height = 0;
  for (int i = 0; i < bodies.deformable[1].particle_count; ++i)
    height += bodies.particles.x[static_cast<std::size_t>(bodies.deformable[1].first_particle + i)].y();
  test::expect_above(height / bodies.deformable[1].particle_count, 0.3, "height of the lower ring, m");
}

}  // namespace
}  // namespace duet::folding_test
