// Stacks that hardly stand, stand, and those that cannot, fall: nothing creeps towards an edge because a
// solver gives up.
#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/everyday.h"
#include "tests/support/margin.h"

#include "sim/scene/schema.h"
#include "sim/step/world.h"

namespace duet::everyday_rigid_stacks_test {
namespace {

// Of the length in 2 s. Where friction keeps a step's solution from being found, sweeps leave some 1e-5 m/s;
// by sweeps alone eight bricks creep ten times as far, or fall.
constexpr double max_creep = 5e-4;
constexpr double length = 0.2, height = 0.06, width = 0.1;  // m, of a brick

// Bricks over the edge of a table at x = 0, the one on top as far out as it can be, the one below it as far
// as both together can be, and so on: 1/2, 1/4, 1/6, 1/8 ... of their length beyond the next one, times
// `share`. Lengths are times `size`, which gravity is as well, so that times stay.
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

// How far a brick has come at most from where it was, m.
double max_moved(const Simulation& simulation, const std::vector<Vec3>& start) {
  double most = 0;
  for (std::size_t i = 0; i < start.size(); ++i)
    most = std::max(most, (simulation.world().bodies.rigid.state[i].pose.position - start[i]).norm());
  return most;
}

std::vector<Vec3> places(const Simulation& simulation) {
  std::vector<Vec3> places;
  for (const RigidState& state : simulation.world().bodies.rigid.state) places.push_back(state.pose.position);
  return places;
}

struct Variant {
  std::string name;
  double size = 1;
  scene::Accuracy accuracy = scene::Accuracy::standard;
  double longest_step = 0;  // s, or 0 for that of the rule
};

const std::vector<Variant>& variants() {
  static const std::vector<Variant> all{{.name = "standard"},
                                        {.name = "draft", .accuracy = scene::Accuracy::draft},
                                        {.name = "fine", .accuracy = scene::Accuracy::fine},
                                        {.name = "steps of 4 ms", .longest_step = 4e-3},
                                        {.name = "bricks of 1 cm", .size = 0.05},
                                        {.name = "bricks of 20 m", .size = 100}};
  return all;
}

// Over 2 s, in parts of the bricks' length.
double lean_out(int count, double share, const Variant& variant) {
  scene::Scene scene = leaning_out(count, share, variant.size);
  scene.solver = scene::preset(variant.accuracy);
  if (variant.longest_step > 0) scene.solver.max_time_step = variant.longest_step;
  Simulation simulation(scene, test::plan(scene));
  const std::vector<Vec3> start = places(simulation);
  for (int frame = 0; frame < 48; ++frame) simulation.advance_frame();
  return max_moved(simulation, start) / (variant.size * length);
}

TEST(EverydayRigidStacks, StandAsFarOutAsTheyCan) {
  double most = 0;
  for (const Variant& variant : variants())
    for (const int count : {1, 2, 4, 8})
      for (const double share : {0.9, 0.98}) {
        const double moved = lean_out(count, share, variant);
        EXPECT_LT(moved, max_creep) << count << " bricks, " << share << " of the way, " << variant.name;
        most = std::max(most, moved);
      }
  test::record_margin("most_moved_over_length", most, "each below 5e-4");
}

TEST(EverydayRigidStacks, FallWhereTheyCannotStand) {
  for (const Variant& variant : variants())
    for (const int count : {1, 2, 4, 8})
      EXPECT_GT(lean_out(count, 1.02, variant), 0.3) << count << " bricks, " << variant.name;
}

}  // namespace
}  // namespace duet::everyday_rigid_stacks_test
