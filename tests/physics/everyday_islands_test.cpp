// Islands are independent. A body far away changes no bit of a stack, rigid or soft, as long as both scenes
// take the same steps, and a heavy body stays on a light one whatever else is in the scene.
#include <cstring>

#include "tests/support/full.h"
#include "tests/support/scenes.h"
#include "tests/support/thin_bodies.h"
#include <gtest/gtest.h>

#include "sim/simulation/simulation.h"
#include "sim/step/world.h"

namespace duet::everyday_islands_test {
namespace {

// Kinds of bodies that are added 20 m away from the stack.
enum class Far { nothing, soft_box, ball, falling_box, jointed_boxes, sheet };

// Adds the body 20 m away from the stack.
void add_far(scene::Scene& scene, Far kind) {
  const Vec3 place(20, 0.5, 0);
  switch (kind) {
    case Far::nothing:
      return;
    case Far::soft_box:
      test::add_soft_box(scene, "far", place, Vec3(1, 1, 1), 2, 3e5);
      return;
    case Far::ball:
      test::add_ball(scene, "far", place, 0.5, 3);
      return;
    case Far::sheet:
      test::add_material(scene, "cloth").youngs_modulus = 1e4;
      test::add_panel(scene, "far", place, Vec2(1, 1), 3, 0.01);
      return;
    case Far::falling_box:
      test::add_box(scene, "far", place + Vec3(0, 0.3, 0), Vec3(1, 1, 1), 5);
      return;
    case Far::jointed_boxes: {
      test::add_box(scene, "far", place, Vec3(1, 1, 1), 5);
      test::add_box(scene, "farther", place + Vec3(2, 0, 0), Vec3(1, 1, 1), 5);
      scene::Joint joint;
      joint.name = "joint";
      joint.parent = "far";
      joint.child = "farther";
      joint.world.position = place + Vec3(1, 0, 0);
      scene.joints.push_back(joint);
      return;
    }
  }
}

// Returns a box of 10 kg that stands, 10 cm off the middle, on one whose mass is smaller by `ratio`.
scene::Scene uneven_stack(double ratio) {
  scene::Scene scene = test::on_ground(0.5);
  test::add_box(scene, "light", Vec3(0, 0.25, 0), Vec3(0.5, 0.5, 0.5), 10 / ratio);
  test::add_box(scene, "heavy", Vec3(0.1, 0.75, 0), Vec3(0.5, 0.5, 0.5), 10);
  return scene;
}

// Returns a tower of six boxes that get heavier upwards.
scene::Scene tower() {
  scene::Scene scene = test::on_ground(0.5);
  for (int i = 0; i < 6; ++i)
    test::add_box(scene, "box" + std::to_string(i), Vec3(0.02 * (i % 3), 0.2 + 0.4 * i + 0.02, 0),
                  Vec3(0.4, 0.4, 0.4), 1 + i);
  return scene;
}

// Returns a soft column on a plate of a hundredth of its mass. This scene has contact inside its velocity
// solves.
scene::Scene column() {
  scene::Scene scene = test::on_ground(0.5);
  test::add_box(scene, "plate", Vec3(0, 0.1, 0), Vec3(1.3, 0.2, 1.3), 10);
  test::add_soft_box(scene, "column", Vec3(0, 0.7, 0), Vec3(1, 1, 1), 3, 2e6);
  return scene;
}

// Returns the states of the stack's bodies after `frames` frames.
std::vector<RigidState> run(scene::Scene scene, Far kind, double longest_step, int frames) {
  const std::size_t count = scene.rigid.size();
  add_far(scene, kind);
  scene.solver.max_time_step = longest_step;
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < frames; ++frame) simulation.advance_frame();
  const std::vector<RigidState>& state = simulation.world().bodies.rigid.state;
  return {state.begin(), state.begin() + static_cast<std::ptrdiff_t>(count)};
}

// All runs have steps of 1 ms. A solve whose norm, preconditioner or number of iterations depends on all
// bodies of the scene, instead of on those of an island, changes bits.
TEST(EverydayIslands, AFarBodyChangesNoBitOfAStack) {
  test::Cases cases(2);  // 8 of 15
  for (const scene::Scene& scene : {uneven_stack(100), tower(), column()}) {
    const std::vector<RigidState> alone = run(scene, Far::nothing, 1e-3, 6);
    for (const Far kind : {Far::soft_box, Far::ball, Far::falling_box, Far::jointed_boxes, Far::sheet}) {
      if (!cases.takes()) continue;
      const std::vector<RigidState> beside = run(scene, kind, 1e-3, 6);
      for (std::size_t i = 0; i < alone.size(); ++i)
        for (int k = 0; k < 3; ++k) {
          EXPECT_EQ(alone[i].pose.position[k], beside[i].pose.position[k]) << static_cast<int>(kind);
          EXPECT_EQ(alone[i].angular_momentum[k], beside[i].angular_momentum[k]) << static_cast<int>(kind);
        }
    }
  }
}

// The step is the one that the rule chooses, and the soft box shortens it. At mass ratios of 100 and 1e4 the
// boxes must not move by a millimeter within two seconds.
TEST(EverydayIslands, AHeavyBoxStaysOnALightOneBesideAFarSoftBox) {
  for (const double ratio : {100.0, 1e4})
    for (const Far kind : {Far::nothing, Far::soft_box}) {
      const scene::Scene scene = uneven_stack(ratio);
      const std::vector<RigidState> state = run(scene, kind, 1.0 / 48, 48);
      for (std::size_t i = 0; i < state.size(); ++i)
        EXPECT_LT((state[i].pose.position - scene.rigid[i].placement.position).norm(), 1e-3)
            << ratio << ", " << static_cast<int>(kind);
    }
}

}  // namespace
}  // namespace duet::everyday_islands_test
