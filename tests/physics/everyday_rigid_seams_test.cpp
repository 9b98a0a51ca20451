// Static tiles of boxes and meshes that lie side by side are one floor: a body that rolls or slides over the
// internal edge between two of them keeps its speed and its height.
#include <algorithm>
#include <cmath>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/meshes.h"
#include <fmt/format.h>

#include "sim/step/world.h"

namespace duet::everyday_rigid_seams_test {
namespace {

using scene::ShapeKind;

// A body that crosses the internal edge. Lengths are relative to the size of the scene.
struct Mover {
  std::string name;
  scene::Shape shape;
  double height;  // of its center above the floor
  double radius;  // of rolling about z; 0 for bodies that slide without friction
};

// Returns bodies that roll and bodies that slide.
std::vector<Mover> movers() {
  return {{"small ball", {.kind = ShapeKind::sphere, .radius = 0.02}, 0.02, 0.02},
          {"ball", {.kind = ShapeKind::sphere, .radius = 0.1}, 0.1, 0.1},
          {"box", {.kind = ShapeKind::box, .size = Vec3(0.1, 0.06, 0.1)}, 0.03, 0},
          {"upright cylinder", {.kind = ShapeKind::cylinder, .radius = 0.05, .length = 0.06}, 0.03, 0},
          {"capsule", {.kind = ShapeKind::capsule, .radius = 0.04, .length = 0.1}, 0.04, 0.04}};
}

// Returns two tiles of 1 x 0.1 x 1 that meet at x = 0, each a mesh or a box, and a body at x = `start` that
// moves towards +x.
scene::Scene on_tiles(const Mover& mover, bool first_is_mesh, bool second_is_mesh, double start, double speed,
                      double size) {
  scene::Scene scene;
  scene.gravity = Vec3(0, -9.8 * size, 0);
  const Vec3 half = size * Vec3(0.5, 0.05, 0.5);
  const auto mesh = std::make_shared<TriangleMesh>(test::box_mesh(-half, half));
  for (const bool is_first : {true, false}) {
    scene::RigidBody tile;
    tile.name = is_first ? "first" : "second";
    tile.is_static = true;
    tile.friction = 0.5;
    tile.placement.position = size * Vec3(is_first ? -0.5 : 0.5, -0.05, 0);
    if (is_first ? first_is_mesh : second_is_mesh) {
      tile.shape = {.kind = ShapeKind::mesh, .scale = 1};
      tile.shape.mesh = mesh;
    } else {
      tile.shape = {.kind = ShapeKind::box, .size = 2 * half};
    }
    scene.rigid.push_back(tile);
  }
  scene::RigidBody body;
  body.name = "body";
  body.shape = test::scaled(mover.shape, size);
  body.density = 1000;
  body.friction = mover.radius > 0 ? 0.5 : 0;
  body.placement.position = size * Vec3(start, mover.height, 0.013);
  body.placement.velocity = size * Vec3(speed, 0, 0);
  if (mover.radius > 0) body.placement.angular_velocity = Vec3(0, 0, -speed / mover.radius);
  if (mover.shape.kind == ShapeKind::capsule)
    body.placement.orientation = exponential(Vec3(EIGEN_PI / 2, 0, 0));
  scene.rigid.push_back(body);
  return scene;
}

// The place at which a body passes the internal edge within a step matters, so each starts from several
// places. A ball of 4 cm at 2 m/s was thrown back by the side of a second tile that is a mesh: from the
// distance of a step, the grid of distances did not tell the edge of the tile well enough to see that the
// ball meets it there.
TEST(EverydayRigidSeams, TilesOfBoxesAndMeshesAreOneFloor) {
  double max_lost = 0, max_hop = 0;
  test::Cases cases(11);  // 8 of 78
  for (const Mover& mover : movers())
    for (const auto& [first, second] : {std::pair(true, true), std::pair(false, true)})
      for (const double speed : {0.5, 2.0, 5.0})
        for (const double start : {-0.3, -0.311})
          for (const double size : {1.0, 20.0}) {
            if (size != 1 && start != -0.311) continue;
            // A flat body that passes its own width within a step sinks by up to a millimeter at the edge, so
            // fast flat bodies are left out.
            if (mover.radius == 0 && speed > 2) continue;
            if (!cases.takes()) continue;
            const scene::Scene scene = on_tiles(mover, first, second, start, speed, size);
            Simulation simulation(scene, test::plan(scene));
            const auto b = test::index_of_shape(simulation.world().bodies);
            const RigidState& state = simulation.world().bodies.rigid.state[b];
            double hop = 0;
            const int frames = std::clamp(static_cast<int>((0.35 - start) / speed * 24), 2, 30);
            for (int frame = 0; frame < frames; ++frame) {
              simulation.advance_frame();
              hop = std::max(hop, std::abs(state.pose.position.y() / size - mover.height) / mover.height);
            }
            const double lost = (state.velocity / size - Vec3(speed, 0, 0)).norm() / speed;
            const std::string what =
                fmt::format("{} from a {} to a {}, {} m/s from {}, size {}", mover.name,
                            first ? "mesh" : "box", second ? "mesh" : "box", speed, start, size);
            EXPECT_GT(state.pose.position.x(), 0) << what;
            EXPECT_LT(lost, 1e-4) << what;
            EXPECT_LT(hop, 1e-4) << what;
            max_lost = std::max(max_lost, lost);
            max_hop = std::max(max_hop, hop);
          }
  test::record_margin("most_lost_speed", max_lost, "each below 1e-4");
  test::record_margin("most_hop", max_hop, "of the height, each below 1e-4");
}

}  // namespace
}  // namespace duet::everyday_rigid_seams_test
