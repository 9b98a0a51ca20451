// Stacks at the limit of balance stand, and those beyond it fall: nothing creeps towards an edge because a
// solver gives up.
#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"

#include "sim/scene/schema.h"
#include "sim/step/world.h"

namespace duet::everyday_rigid_stacks_test {
namespace {

// Largest displacement of a brick in 2 s, over its length. Where friction keeps sweeps from finding the
// solution of a step, they leave some 1e-5 m/s. By sweeps alone eight bricks creep ten times as far, or fall.
constexpr double max_creep = 5e-4;
constexpr double length = 0.2, height = 0.06, width = 0.1;  // m, of a brick

// Returns bricks that lean over the edge of a table at x = 0. The top one stands as far out as it can, the
// one below it as far as both together can, and so on: 1/2, 1/4, 1/6, 1/8 ... of the length beyond the next
// one, times `share`. All lengths and gravity are multiplied by `size`, so that motions take the same time.
scene::Scene leaning_out(int count, double share, double size) {
  scene::Scene scene;
  scene.gravity = Vec3(0, -9.8, 0) * size;
  const auto add = [&](const std::string& name, const Vec3& position,
                       const Vec3& extent) -> scene::RigidBody& {
    scene::RigidBody& body = test::add_box(scene, name, size * position, size * extent, 1);
    body.mass.reset();
    body.density = 1000;
    body.friction = 0.5;
    return body;
  };
  scene::RigidBody& table = add("table", Vec3(-0.5, -0.25, 0), Vec3(1, 0.5, 1));
  table.is_static = true;
  table.density.reset();
  double end = 0;
  for (int i = 0; i < count; ++i) {
    end += share * length / 2 / (count - i);
    add("brick" + std::to_string(i), Vec3(end - length / 2, (i + 0.5) * height, 0.013),
        Vec3(length, height, width));
  }
  return scene;
}

// Returns the largest displacement (m) of a body from its position in `start`.
double max_moved(const Simulation& simulation, const std::vector<Vec3>& start) {
  double most = 0;
  for (std::size_t i = 0; i < start.size(); ++i)
    most = std::max(most, (simulation.world().bodies.rigid.state[i].pose.position - start[i]).norm());
  return most;
}

// Returns the positions of all rigid bodies (m).
std::vector<Vec3> places(const Simulation& simulation) {
  std::vector<Vec3> places;
  for (const RigidState& state : simulation.world().bodies.rigid.state) places.push_back(state.pose.position);
  return places;
}

// Settings under which stacks must stand or fall alike.
struct Variant {
  std::string name;
  double size = 1;
  scene::Accuracy accuracy = scene::Accuracy::standard;
  double longest_step = 0;  // s; 0 for the step of the rule
};

// Returns the accuracies, a shorter step and other sizes.
const std::vector<Variant>& variants() {
  static const std::vector<Variant> all{{.name = "standard"},
                                        {.name = "draft", .accuracy = scene::Accuracy::draft},
                                        {.name = "fine", .accuracy = scene::Accuracy::fine},
                                        {.name = "steps of 4 ms", .longest_step = 4e-3},
                                        {.name = "bricks of 1 cm", .size = 0.05},
                                        {.name = "bricks of 20 m", .size = 100}};
  return all;
}

// Returns the largest displacement of a brick within 2 s, over the bricks' length.
double lean_out(int count, double share, const Variant& variant) {
  scene::Scene scene = leaning_out(count, share, variant.size);
  scene.solver = scene::preset(variant.accuracy);
  if (variant.longest_step > 0) scene.solver.max_time_step = variant.longest_step;
  Simulation simulation(scene, test::plan(scene));
  const std::vector<Vec3> start = places(simulation);
  for (int frame = 0; frame < 48; ++frame) simulation.advance_frame();
  return max_moved(simulation, start) / (variant.size * length);
}

// At 90 % and 98 % of the largest overhang (the harmonic series) the stack is in balance.
TEST(EverydayRigidStacks, StandAsFarOutAsTheyCan) {
  double most = 0;
  test::Cases cases(5);  // 10 of 48
  for (const Variant& variant : variants())
    for (const int count : {1, 2, 4, 8})
      for (const double share : {0.9, 0.98}) {
        if (!cases.takes()) continue;
        const double moved = lean_out(count, share, variant);
        EXPECT_LT(moved, max_creep) << count << " bricks, " << share << " of the way, " << variant.name;
        most = std::max(most, moved);
      }
  test::record_margin("most_moved_over_length", most, "each below 5e-4");
}

// At 102 % the bricks' centers of mass are beyond their supports, so the stack falls. Contacts that pull
// would hold it.
TEST(EverydayRigidStacks, FallWhereTheyCannotStand) {
  test::Cases cases(5);  // 5 of 24
  for (const Variant& variant : variants())
    for (const int count : {1, 2, 4, 8})
      if (cases.takes()) {
        EXPECT_GT(lean_out(count, 1.02, variant), 0.3) << count << " bricks, " << variant.name;
      }
}

}  // namespace
}  // namespace duet::everyday_rigid_stacks_test
