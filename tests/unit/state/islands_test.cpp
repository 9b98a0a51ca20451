// Islands: the bodies that move each other in a velocity solve.
#include "sim/state/islands.h"

#include "tests/support/places.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/scene/reader/reader.h"
#include "sim/step/step.h"

namespace duet::islands_test {
namespace {

// Returns the islands of a world, with or without the joining by contacts and repulsions.
Islands find(World& world, bool with_contacts = true) {
  StepContext& context = world.context;
  Islands islands;
  islands.begin(world.bodies);
  if (with_contacts) {
    context.solve.projection.build(world.bodies, context.contact.contacts, context.contact.graph, 1,
                                   &context.surfaces.repulsion);
    context.solve.projection.join(islands);
  }
  islands.finish();
  return islands;
}

// Returns the island of a deformable body.
int of_deformable(const Bodies& bodies, const Islands& islands, std::size_t body) {
  return islands.of_particle(bodies.deformable[body].first_particle);
}

// Two stacks stand on the same ground, beside a box that touches nothing and two soft boxes whose surfaces
// repel each other. Contacts and repulsions join islands; the static ground belongs to none.
TEST(Islands, ContactJoinsButTheGroundDoesNot) {
  scene::Scene scene = test::on_ground(0.4);
  test::add_soft_box(scene, "soft", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 2);
  test::add_soft_box(scene, "other", Vec3(3, 0.5, 0), Vec3(1, 1, 1), 2);
  test::add_soft_box(scene, "lower", Vec3(6, 0.5, 0), Vec3(1, 1, 1), 2);
  test::add_soft_box(scene, "upper", Vec3(6.1, 1.54, 0.05), Vec3(1, 1, 1), 2);
  test::add_box(scene, "load", Vec3(0, 1.499, 0), Vec3(1, 1, 1), 700);
  test::add_box(scene, "other load", Vec3(3, 1.499, 0), Vec3(1, 1, 1), 700);
  test::add_box(scene, "alone", Vec3(9, 5, 0), Vec3(1, 1, 1), 700);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 40; ++i) step(world, i * 1e-3, 1e-3);
  const Bodies& bodies = world.bodies;
  const Islands islands = find(world);
  EXPECT_EQ(islands.size(), 4u);
  EXPECT_EQ(islands.searched(), 4u);
  const auto rigid = [&](const std::string& name) {
    for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
      if (bodies.rigid.name[i] == name) return islands.of_rigid(i);
    ADD_FAILURE() << name;
    return -2;
  };
  EXPECT_EQ(rigid("ground"), -1);
  EXPECT_EQ(rigid("load"), of_deformable(bodies, islands, 0));
  EXPECT_EQ(rigid("other load"), of_deformable(bodies, islands, 1));
  EXPECT_NE(rigid("load"), rigid("other load"));
  EXPECT_EQ(of_deformable(bodies, islands, 2), of_deformable(bodies, islands, 3));
  EXPECT_NE(rigid("alone"), rigid("load"));
  EXPECT_EQ(find(world, false).size(), 7u);  // every body is its own island
}

// In the scene `maggot`, bones, joints and flesh are one island without any contact.
TEST(Islands, BonesAndTheirJointsJoinTheFlesh) {
  const scene::Scene scene = scene::read(test::source_folder() + "/scenes/maggot.toml").scene;
  Simulation simulation(scene, test::plan(scene));
  EXPECT_GE(simulation.world().bodies.rigid.size(), 3u);
  EXPECT_EQ(find(simulation.world(), false).size(), 1u);
}

// Every particle of a searched island is in one range of at most 1024 particles and in the mask. An island
// that is left is in neither.
TEST(Islands, LeaveRangesAndMaskWhenDone) {
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "small", Vec3::Zero(), Vec3(1, 1, 1), 2);
  test::add_soft_box(scene, "large", Vec3(5, 0, 0), Vec3(1, 1, 1), 14);  // 3375 particles
  test::add_box(scene, "rigid", Vec3(9, 0, 0), Vec3(1, 1, 1), 1);
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  Islands islands = find(simulation.world(), false);
  ASSERT_EQ(islands.size(), 3u);
  const auto in_ranges = [&] {
    std::vector<int> count(bodies.particles.size(), 0);
    for (const Islands::Range& range : islands.ranges()) {
      EXPECT_TRUE(islands.is_searched(range.island));
      EXPECT_LE(range.end - range.begin, 1024u);
      for (std::size_t p = range.begin; p < range.end; ++p) {
        ++count[p];
        EXPECT_EQ(islands.of_particle(static_cast<int>(p)), static_cast<int>(range.island));
        EXPECT_TRUE(islands.mask().has(p));
      }
    }
    return count;
  };
  EXPECT_EQ(in_ranges(), std::vector<int>(bodies.particles.size(), 1));

  const auto large = static_cast<std::size_t>(of_deformable(bodies, islands, 1));
  islands.leave(large);
  islands.update();
  EXPECT_EQ(islands.searched(), 2u);
  EXPECT_FALSE(islands.is_searched(large));
  EXPECT_TRUE(islands.is_searched_rigid(0));
  std::vector<int> expected(bodies.particles.size(), 0);
  for_each_particle(bodies.deformable[0], [&](std::size_t p) { expected[p] = 1; });
  EXPECT_EQ(in_ranges(), expected);
  EXPECT_FALSE(islands.mask().has(bodies.particles.size() - 1));
}

}  // namespace
}  // namespace duet::islands_test
