#include "sim/scene/static_gaps.h"

#include "tests/support/meshes.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/scene/explain.h"

namespace duet {
namespace {

// Tiles of 1 x 0.1 x 1 m in a row, `gap` (m) apart, above the ground, with a ball.
scene::Scene tiles(int count, double gap, bool is_mesh) {
  scene::Scene scene;
  scene.ground = scene::Ground{};
  for (int i = 0; i < count; ++i) {
    scene::RigidBody tile;
    tile.name = fmt::format("tile{}", i);
    tile.is_static = true;
    tile.shape = {.kind = scene::ShapeKind::box, .size = Vec3(1, 0.1, 1)};
    if (is_mesh) {
      tile.shape = {.kind = scene::ShapeKind::mesh, .scale = 1};
      tile.shape.mesh =
          std::make_shared<TriangleMesh>(test::box_mesh(-Vec3(0.5, 0.05, 0.5), Vec3(0.5, 0.05, 0.5)));
    }
    tile.placement.position = Vec3(i * (1 + gap), 0.051, 0);
    scene.rigid.push_back(tile);
  }
  scene::RigidBody ball;
  ball.name = "ball";
  ball.shape = {.kind = scene::ShapeKind::sphere, .radius = 0.1};
  ball.density = 1000;
  ball.placement.position = Vec3(0, 0.3, 0);
  scene.rigid.push_back(ball);
  return scene;
}

std::vector<StaticGap> gaps_of(const scene::Scene& scene) {
  return Simulation(scene, test::plan(scene)).sizes().static_gaps;
}

TEST(StaticGaps, AreThoseThatNobodyWants) {
  for (const bool is_mesh : {false, true}) {
    EXPECT_TRUE(gaps_of(tiles(2, 0, is_mesh)).empty());
    EXPECT_TRUE(gaps_of(tiles(2, 5e-6, is_mesh)).empty()) << "adjoins";
    EXPECT_TRUE(gaps_of(tiles(2, 0.02, is_mesh)).empty()) << "to be seen";
    for (const double gap : {2e-5, 1e-4, 5e-3}) {
      const std::vector<StaticGap> found = gaps_of(tiles(3, gap, is_mesh));
      ASSERT_EQ(found.size(), 2U) << gap;
      EXPECT_EQ(found[0].first, "tile0");
      EXPECT_EQ(found[0].second, "tile1");
      EXPECT_NEAR(found[0].gap, gap, 1e-9);
    }
  }
  scene::Scene still = tiles(2, 1e-4, false);
  still.rigid.pop_back();
  EXPECT_TRUE(gaps_of(still).empty()) << "nothing moves over it";
}

TEST(StaticGaps, AreWarnedOf) {
  const scene::Scene scene = tiles(3, 1e-4, false);
  const scene::EffectPlan plan = scene::plan_effects(scene);
  const std::vector<std::string> found = warnings(scene, plan, Simulation(scene, plan.active()).sizes());
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NE(found[0].find("`tile0` and `tile1` stand 0.0001 m apart (and 1 more pair)"), std::string::npos)
      << found[0];
  EXPECT_EQ(describe_gaps({}), "");
}

}  // namespace
}  // namespace duet
