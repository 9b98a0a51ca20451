// Floors of tiles with gaps or with a lower second tile. A body that slides over a gap keeps its speed, and a
// body that rolls loses no more than pivoting about the second edge takes.
#include <algorithm>
#include <cmath>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/meshes.h"
#include <fmt/format.h>

#include "sim/step/world.h"

namespace duet::everyday_rigid_tiles_test {
namespace {

using scene::ShapeKind;

// A body that passes from one tile to the next. Lengths are relative to the size of the scene.
struct Passing {
  std::string name;
  scene::Shape shape;
  double radius = 0;  // of rolling; 0 for bodies that slide without friction
  double height = 0;  // of the center over the floor
};

// Returns two bodies that roll and two that slide.
std::vector<Passing> passing() {
  return {{"ball", {.kind = ShapeKind::sphere, .radius = 0.2}, 0.2, 0.2},
          {"can", {.kind = ShapeKind::cylinder, .radius = 0.2, .length = 0.6}, 0.2, 0.2},
          {"box", {.kind = ShapeKind::box, .size = Vec3(0.8, 0.4, 0.6)}, 0, 0.2},
          {"puck", {.kind = ShapeKind::cylinder, .radius = 0.5, .length = 0.6}, 0, 0.3}};
}

// Arrangement of the two tiles, in sizes.
struct Floor {
  double gap = 0, drop = 0;  // distance of the tiles; by how much the second one is lower
  bool is_mesh = false;
  bool lies_on_ground = false;  // whether the first tile is a dynamic body that rests on the ground
};

// Returns a tile on the side `side` (-1 or 1) of the gap.
scene::RigidBody tile(const std::string& name, const Floor& floor, double side) {
  scene::RigidBody tile;
  tile.name = name;
  tile.is_static = !floor.lies_on_ground || side > 0;
  if (!tile.is_static) tile.density = 1e4;
  const Vec3 half(6, 1, 3);
  tile.shape = {.kind = ShapeKind::box, .size = 2 * half};
  if (floor.is_mesh) {
    tile.shape = {.kind = ShapeKind::mesh, .scale = 1};
    tile.shape.mesh = std::make_shared<TriangleMesh>(test::box_mesh(-half, half));
  }
  tile.placement.position =
      Vec3(side * (half.x() + floor.gap / 2), -half.y() - (side > 0 ? floor.drop : 0), 0);
  return tile;
}

// Returns a body that moves along +x over the tiles. The whole scene is turned about the vertical by `turn`
// (rad).
scene::Scene on_tiles(const Passing& passing, const Floor& floor, double speed, double size, double turn) {
  scene::Scene scene;
  scene.gravity = Vec3(0, -9.8 * size, 0);
  scene::RigidBody body;
  body.name = "body";
  body.shape = passing.shape;
  body.density = 1000;
  body.friction = passing.radius > 0 ? 0.5 : 0;
  body.placement.position = Vec3(-3, passing.height, 0.13);
  if (passing.name == "can") body.placement.orientation = exponential(Vec3(EIGEN_PI / 2, 0, 0));
  body.placement.velocity = Vec3(speed, 0, 0);
  if (passing.radius > 0) body.placement.angular_velocity = Vec3(0, 0, -speed / passing.radius);
  scene.rigid = {body, tile("first", floor, -1), tile("second", floor, 1)};
  if (floor.lies_on_ground) scene.ground = scene::Ground{.height = -2 * size, .friction = 0.5, .look = {}};
  const Quat turned = exponential(Vec3(0, turn, 0));
  for (scene::RigidBody& each : scene.rigid) {
    each.shape = test::scaled(each.shape, size);
    if (&each != &scene.rigid.front()) each.friction = 0.5;
    each.placement.position = size * (turned * each.placement.position);
    each.placement.orientation = turned * each.placement.orientation;
    each.placement.velocity = size * (turned * each.placement.velocity);
    each.placement.angular_velocity = turned * each.placement.angular_velocity;
  }
  return scene;
}

// Result of a passage.
struct Passed {
  Vec3 position;       // m, at the end
  double change = 0;   // of the speed along the path at the end, over the speed at the start
  double hop = 0;      // largest height above the start, in sizes
  double overlap = 0;  // largest penetration, in sizes
};
// Simulates 5.5 sizes of the path, from 3 before the gap.
Passed pass(const scene::Scene& scene, double speed, double size, double turn) {
  Simulation simulation(scene, test::plan(scene));
  const RigidState& state =
      simulation.world().bodies.rigid.state[test::index_of_shape(simulation.world().bodies)];
  const double start = state.pose.position.y();
  const Vec3 along = exponential(Vec3(0, turn, 0)) * Vec3::UnitX();
  Passed passed;
  const int frames = static_cast<int>(std::ceil(5.5 / speed * scene.fps));
  for (int frame = 0; frame < frames; ++frame) {
    simulation.advance_frame();
    passed.hop = std::max(passed.hop, (state.pose.position.y() - start) / size);
    passed.overlap = std::max(passed.overlap, simulation.stats().max_penetration / size);
  }
  passed.position = state.pose.position;
  passed.change = state.velocity.dot(along) / size / speed - 1;
  return passed;
}

// Returns the largest relative loss of speed at a gap. A body that pivots from the first to the second edge
// turns its center's direction by a = 2 asin(gap / (2 R)) and keeps (I + m R^2 cos a) / (I + m R^2) of its
// speed, with I at least 2/5 m R^2. A rebound from the edge adds at most as much again.
double max_loss(const Passing& passing, double gap) {
  if (passing.radius == 0) return 0;
  const double ratio = gap / (2 * passing.radius);
  return 2 * (1 - (0.4 + 1 - 2 * ratio * ratio) / 1.4);
}

// Bodies were thrown up or back here. The predicted position of a flat box's corner, fallen by g dt^2 / 2,
// was taken to hit the side of the second tile, and so was the point of that side that is nearest to a ball
// from afar.
TEST(EverydayRigidTiles, GapsAndLowerTilesThrowNothing) {
  double max_change = 0, max_hop = 0;
  test::Cases cases(5);  // 17 of 84
  for (const Passing& body : passing())
    for (const Floor& floor : {Floor{1e-4, 0}, Floor{1e-3, 0}, Floor{1e-2, 0}, Floor{5e-2, 0}, Floor{0, 1e-3},
                               Floor{0, 1e-2}, Floor{1e-2, 1e-2}})
      for (const double speed : {10.0, 20.0, 50.0}) {
        const int number = cases.offered();
        if (!cases.takes()) continue;
        constexpr double sizes[] = {0.1, 0.002, 5}, turns[] = {0, 0.7};
        const double size = sizes[number % 3], turn = turns[number % 2];
        Floor tiles = floor;
        tiles.is_mesh = number % 4 == 3;
        scene::Scene scene = on_tiles(body, tiles, speed, size, turn);
        const Passed passed = pass(scene, speed, size, turn);
        const std::string name =
            fmt::format("{} at {} sizes/s of {} m, gap {}, drop {}{}, turned by {}", body.name, speed, size,
                        tiles.gap, tiles.drop, tiles.is_mesh ? ", meshes" : "", turn);
        const double loss = std::max(0.0, -passed.change - max_loss(body, floor.gap));
        EXPECT_LT(loss, 2e-3) << name;
        EXPECT_LT(passed.change, 2e-3) << name;
        EXPECT_LT(passed.hop, 0.02) << name;
        max_change = std::max({max_change, loss, passed.change});
        max_hop = std::max(max_hop, passed.hop);
      }
  test::record_margin("most_change_of_speed", max_change, "each below 2e-3");
  test::record_margin("most_hop_in_sizes", max_hop, "each below 0.02");
}

// Bodies that meet the second tile in other places of a step than above. The first two were thrown up by more
// than half of their radius: the fall of the step was taken to lead the ball onto the edge of the second
// tile, though the first one holds it up. The box met the rims of a narrow gap in a direction that leaned by
// 16 degrees, pucks met the side of the second tile below their rim, and the fast puck tipped over a single
// point in the step in which it left the first tile.
TEST(EverydayRigidTiles, BodiesPassInAnyPlaceOfAStep) {
  struct Case {
    std::size_t body;
    Floor floor;
    double speed, size;
  };
  double max_change = 0, max_hop = 0;
  for (const Case& one : {Case{0, {1e-3, 0, true}, 13, 0.3}, Case{0, {0, 1e-3, true}, 13, 1},
                          Case{0, {1e-3, 0, true, true}, 13, 1}, Case{2, {1e-4, 0, true}, 10, 0.3},
                          Case{3, {1e-3, 0, true}, 3, 0.3}, Case{3, {0, 0, true}, 60, 0.3}}) {
    const Passing body = passing()[one.body];
    const Passed passed = pass(on_tiles(body, one.floor, one.speed, one.size, 0), one.speed, one.size, 0);
    const std::string name = fmt::format("{} at {} sizes/s of {} m, gap {}, drop {}", body.name, one.speed,
                                         one.size, one.floor.gap, one.floor.drop);
    const double change = std::max(passed.change, -passed.change - max_loss(body, one.floor.gap));
    EXPECT_LT(change, 2e-4) << name;
    EXPECT_LT(passed.hop, 1e-4) << name;
    max_change = std::max(max_change, change);
    max_hop = std::max(max_hop, passed.hop);
  }
  test::record_margin("most_change_of_speed", max_change, "each below 2e-4");
  test::record_margin("most_hop_in_sizes", max_hop, "each below 1e-4");
}

// Adjoining tiles are one floor at any speed. Points of a flat body that begin a step over the first tile and
// end it over the second one lay on neither, and the body sank by 3 % of its height.
TEST(EverydayRigidTiles, TilesThatAdjoinAreOneFloor) {
  double max_change = 0, max_hop = 0, max_overlap = 0;
  test::Cases cases(5);  // 5 of 24
  for (const Passing& body : passing())
    for (const double speed : {10.0, 60.0, 300.0})
      for (const bool is_mesh : {false, true}) {
        constexpr double sizes[] = {0.1, 0.002, 5}, turns[] = {0, 0.7};
        const double size = sizes[cases.offered() % 3], turn = turns[cases.offered() % 2];
        if (!cases.takes()) continue;
        const Passed passed = pass(on_tiles(body, {0, 0, is_mesh}, speed, size, turn), speed, size, turn);
        const std::string name = fmt::format("{} at {} sizes/s of {} m{}, turned by {}", body.name, speed,
                                             size, is_mesh ? ", meshes" : "", turn);
        EXPECT_LT(std::abs(passed.change), 1e-4) << name;
        EXPECT_LT(passed.hop, 1e-4) << name;
        EXPECT_LT(passed.overlap, 1e-4) << name;
        max_change = std::max(max_change, std::abs(passed.change));
        max_hop = std::max(max_hop, passed.hop);
        max_overlap = std::max(max_overlap, passed.overlap);
      }
  test::record_margin("most_change_of_speed", max_change, "below 1e-4");
  test::record_margin("most_hop_in_sizes", max_hop, "below 1e-4");
  test::record_margin("most_overlap_in_sizes", max_overlap, "below 1e-4");
}

// A box reaches over the side of the floor by almost half of its width and slides along that side. Its lower
// edge lies in the plane of the floor where it crosses the rim, so it must touch neither the rim's other face
// nor, along the rim, the corners of the tiles at the internal edge. At 25 sizes/s every step has other
// contact points, whose gaps differ by the tolerance of the solve: after ten steps the box is 2e-4 sizes off
// its line, and the bound is 3e-4.
TEST(EverydayRigidTiles, BoxesSlideAlongTheSideThatTheyReachOver) {
  double most = 0;
  int number = 0;
  for (const double speed : {2.0, 10.0, 25.0})
    for (const bool is_mesh : {false, true}) {
      constexpr double sizes[] = {0.1, 0.002, 5}, turns[] = {0, 0.7};
      const double size = sizes[number % 3], turn = turns[number++ % 2];
      scene::Scene scene = on_tiles(passing()[2], {0, 0, is_mesh}, speed, size, turn);
      Vec3& x = scene.rigid[0].placement.position;
      // 1 cm inside a rim at 3 m, for the size 1
      x += size * (exponential(Vec3(0, turn, 0)) * Vec3(0, 0, 2.99 - 0.13));
      const Vec3 before = x;
      const Passed passed = pass(scene, speed, size, turn);
      const std::string name = fmt::format("{} sizes/s of {} m{}", speed, size, is_mesh ? ", meshes" : "");
      const Vec3 along = exponential(Vec3(0, turn, 0)) * Vec3::UnitX();
      const Vec3 way = passed.position - before;
      const double off = (way - way.dot(along) * along).norm() / size;
      EXPECT_LT(std::abs(passed.change), 1e-4) << name;
      EXPECT_LT(off, 3e-4) << name;
      most = std::max(most, off);
    }
  test::record_margin("farthest_off_the_line_in_sizes", most, "each below 3e-4");
}

}  // namespace
}  // namespace duet::everyday_rigid_tiles_test
