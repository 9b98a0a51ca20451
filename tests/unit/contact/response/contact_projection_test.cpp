// The active set of the projection onto contact constraints.
#include "sim/contact/response/contact_projection.h"

#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/step.h"

namespace duet::contact_projection_test {
namespace {

// Boxes on each other on the ground fall freely in the prediction, so that they do not approach each other,
// or, with rounding, part. Only the ground is violated at first; each box that it stops makes the contact
// above a violated one.
TEST(ActiveSet, GrowsFromTheGroundThroughAStackThatFallsFreely) {
  constexpr int boxes = 4;
  scene::Scene scene = test::on_ground();
  for (int i = 0; i < boxes; ++i)
    test::add_box(scene, "box" + std::to_string(i), Vec3(0, 0.5 + i, 0), Vec3(1, 1, 1), 10 + i);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 20; ++i) step(world, i * 1e-3, 1e-3);
  Bodies& bodies = world.bodies;
  ContactProjection projection;
  projection.build(bodies, world.context.contact.contacts, world.context.contact.graph, 1000);

  GeneralizedVelocity rest, fall;
  to_generalized(bodies, rest);
  for (std::vector<Vec3>* part : {&rest.linear, &rest.angular})
    for (Vec3& value : *part) value.setZero();
  fall = rest;
  std::vector<std::size_t> stack;  // from the lowest box up
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_dynamic()) stack.push_back(i);
  ASSERT_EQ(stack.size(), static_cast<std::size_t>(boxes));
  for (std::size_t i = 0; i < stack.size(); ++i)  // each a little slower than the one below
    fall.linear[stack[i]] = Vec3(0, -1 + 1e-9 * static_cast<double>(i), 0);

  EXPECT_FALSE(projection.choose(1e-3, 0.5, rest, fall));
  int rounds = 0;
  for (; rounds < boxes; ++rounds) {
    GeneralizedVelocity held = fall;
    projection.satisfy(held);
    for (int i = 0; i < boxes; ++i)
      EXPECT_NEAR(held.linear[stack[static_cast<std::size_t>(i)]].y(), i <= rounds ? 0 : -1, 1e-6)
          << "box " << i << ", round " << rounds;
    if (!projection.activate_violated(1e-3, 0.5, rest, held)) break;
  }
  EXPECT_EQ(rounds, boxes - 1);
  EXPECT_TRUE(projection.choose(1e-3, 0.5, rest, rest));  // at rest nothing separates
}

// Boxes that do separate stay inactive whatever the others do.
TEST(ActiveSet, LeavesOutWhatSeparates) {
  scene::Scene scene = test::on_ground();
  test::add_box(scene, "lower", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 10);
  test::add_box(scene, "upper", Vec3(0, 1.5, 0), Vec3(1, 1, 1), 10);
  Simulation simulation(scene, test::plan(scene));
  World& world = simulation.world();
  for (int i = 0; i < 20; ++i) step(world, i * 1e-3, 1e-3);
  ContactProjection projection;
  projection.build(world.bodies, world.context.contact.contacts, world.context.contact.graph, 100);
  GeneralizedVelocity rest, v;
  to_generalized(world.bodies, rest);
  for (std::vector<Vec3>* part : {&rest.linear, &rest.angular})
    for (Vec3& value : *part) value.setZero();
  v = rest;
  std::vector<std::size_t> stack;
  for (std::size_t i = 0; i < world.bodies.rigid.size(); ++i)
    if (world.bodies.rigid.properties[i].is_dynamic()) stack.push_back(i);
  v.linear[stack[0]] = Vec3(0, -1, 0);
  v.linear[stack[1]] = Vec3(0, 0.5, 0);
  EXPECT_FALSE(projection.choose(1e-3, 0.5, rest, v));
  GeneralizedVelocity held = v;
  projection.satisfy(held);
  EXPECT_FALSE(projection.activate_violated(1e-3, 0.5, rest, held));
  EXPECT_NEAR(held.linear[stack[0]].y(), 0, 1e-9);
  EXPECT_EQ(held.linear[stack[1]].y(), 0.5);
}

}  // namespace
}  // namespace duet::contact_projection_test
