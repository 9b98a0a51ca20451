// Bones that hold particles on one line only can turn in their flesh, and `duet check` says so.
#include <string>

#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/scene/explain.h"
#include "sim/simulation/simulation.h"

namespace duet::sizes_test {
namespace {

// Returns the sizes of a flesh of 1 x 0.4 x 0.4 m with nodes 0.2 m apart across it, around a bone of
// 0.8 x `thickness` x `thickness` m.
WorldSizes sizes_with_bone(double thickness, bool with_springs) {
  scene::Scene scene = test::free_space();
  scene::RigidBody& bone = test::add_box(scene, "bone", Vec3::Zero(), Vec3(0.8, thickness, thickness), 1);
  bone.friction = 0;
  scene::DeformableBody& flesh = test::add_soft_box(scene, "flesh", Vec3::Zero(), Vec3(1, 0.4, 0.4), 10, 1e5);
  flesh.shape.cells = Vec3i(8, 2, 2);
  flesh.attach = {"bone"};
  if (with_springs) flesh.attach_springs = scene::AttachSprings();
  return Simulation(scene, test::plan(scene)).sizes();
}

TEST(WorldSizes, TellBonesThatHoldOneLineOfParticles) {
  for (const bool with_springs : {false, true}) {
    const WorldSizes thin = sizes_with_bone(0.05, with_springs);
    ASSERT_EQ(thin.loose_bones.size(), 1u) << with_springs;
    EXPECT_EQ(thin.loose_bones[0].bone, "bone");
    EXPECT_EQ(thin.loose_bones[0].flesh, "flesh");
    EXPECT_EQ(thin.loose_bones[0].particles, 7);
    const auto found = scene::warnings(test::free_space(), {}, thin);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_NE(found[0].find("7 particles"), std::string::npos) << found[0];
    EXPECT_TRUE(sizes_with_bone(0.5, with_springs).loose_bones.empty()) << with_springs;
  }
}

}  // namespace
}  // namespace duet::sizes_test
