// Bodies that reach over the sides of what they lie on. Cylinders and capsules, as wheels on rails and as
// logs below slabs, touch along a line that ends where these sides end, and roll as on a wide plane.
#include <algorithm>
#include <cmath>

#include "tests/support/everyday.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/meshes.h"
#include <fmt/format.h>

#include "sim/step/world.h"

namespace duet::everyday_rigid_overhang_test {
namespace {

using scene::ShapeKind;

// A named shape. Lengths are relative to the size of the scene, by which scale() multiplies them.
struct Case {
  std::string name;
  scene::Shape shape;
};

// Returns wheels with a radius of 0.2. Their axis is y in the body frame, and on_rails() turns it to z.
std::vector<Case> wheels() {
  return {{"long cylinder", {.kind = ShapeKind::cylinder, .radius = 0.2, .length = 1.2}},
          {"cylinder that ends over the rails", {.kind = ShapeKind::cylinder, .radius = 0.2, .length = 0.62}},
          {"long capsule", {.kind = ShapeKind::capsule, .radius = 0.2, .length = 1.2}},
          {"capsule that ends over the rails", {.kind = ShapeKind::capsule, .radius = 0.2, .length = 0.62}}};
}

// Returns rails along x with a length of 40. Their middle lies 0.05 below the wheel.
std::vector<Case> rails() {
  std::vector<Case> rails{{"box", {.kind = ShapeKind::box, .size = Vec3(40, 0.1, 0.1)}},
                          {"narrow box", {.kind = ShapeKind::box, .size = Vec3(40, 0.1, 0.01)}},
                          {"mesh", {.kind = ShapeKind::mesh, .scale = 1}},
                          {"cylinder", {.kind = ShapeKind::cylinder, .radius = 0.05, .length = 40}},
                          {"capsule", {.kind = ShapeKind::capsule, .radius = 0.05, .length = 40}}};
  rails[2].shape.mesh =
      std::make_shared<TriangleMesh>(test::box_mesh(-Vec3(20, 0.05, 0.05), Vec3(20, 0.05, 0.05)));
  return rails;
}

// Multiplies all lengths of a scene by `size`, gravity included, so that motions take the same time.
void scale(scene::Scene& scene, double size) {
  scene.gravity *= size;
  for (scene::RigidBody& body : scene.rigid) {
    body.shape = test::scaled(body.shape, size);
    body.placement.position *= size;
    body.placement.velocity *= size;
  }
}

// Returns a wheel that rolls without slipping along two static rails at z = -0.3 and z = 0.3.
scene::Scene on_rails(const Case& wheel, const Case& rail, double speed) {
  scene::Scene scene;
  scene.gravity = Vec3(0, -9.8, 0);
  scene::RigidBody body;
  body.name = "body";
  body.shape = wheel.shape;
  body.density = 1000;
  body.friction = 0.5;
  body.placement.position = Vec3(0, 0.2, 0);
  body.placement.orientation = exponential(Vec3(EIGEN_PI / 2, 0, 0));
  body.placement.velocity = Vec3(speed, 0, 0);
  body.placement.angular_velocity = Vec3(0, 0, -speed / 0.2);
  scene.rigid.push_back(body);
  const bool is_round = rail.shape.kind == ShapeKind::cylinder || rail.shape.kind == ShapeKind::capsule;
  for (const double side : {-0.3, 0.3}) {
    scene::RigidBody host;
    host.name = side < 0 ? "left" : "right";
    host.shape = rail.shape;
    host.is_static = true;
    host.friction = 0.5;
    host.placement.position = Vec3(0, -0.05, side);
    if (is_round) host.placement.orientation = exponential(Vec3(0, 0, EIGEN_PI / 2));
    scene.rigid.push_back(host);
  }
  return scene;
}

// The largest deviations of a body called "body": of its velocity along and across the direction of motion,
// over its speed, and of its height from `height`, over `radius`. Velocity, height and radius are relative to
// the size.
struct Rolled {
  double change = 0, across = 0, hop = 0;
};
// Simulates `frames` frames and returns the deviations.
Rolled roll(const scene::Scene& scene, double size, int frames, const Vec3& velocity, double height,
            double radius) {
  Simulation simulation(scene, test::plan(scene));
  const RigidState& state =
      simulation.world().bodies.rigid.state[test::index_of_shape(simulation.world().bodies)];
  Rolled rolled;
  for (int frame = 0; frame < frames; ++frame) {
    simulation.advance_frame();
    const Vec3 along = velocity.normalized(), change = state.velocity / size - velocity;
    const double ahead = change.dot(along);
    rolled.change = std::max(rolled.change, std::abs(ahead) / velocity.norm());
    rolled.across = std::max(rolled.across, (change - ahead * along).norm() / velocity.norm());
    rolled.hop = std::max(rolled.hop, std::abs(state.pose.position.y() / size - height) / radius);
  }
  return rolled;
}

// A wheel on two narrow rails keeps its speed, its line and its height as on a plane; 1e-4 leaves room for
// the tolerance of the contact solve. Contact at the ends of the wheel alone, beside the rails, would let it
// fall between them.
TEST(EverydayRigidOverhang, WheelsRollOnRailsNarrowerThanTheyAre) {
  double max_change = 0, max_hop = 0;
  test::Cases cases(7);  // 9 of 60
  for (const Case& rail : rails())
    for (const Case& wheel : wheels())
      for (const double speed : {0.3, 1.0, 3.0}) {
        const int number = cases.offered();
        if (!cases.takes()) continue;
        scene::Scene scene = on_rails(wheel, rail, speed);
        constexpr double sizes[] = {1, 0.01, 20};
        const double size = sizes[number / 2 % 3];
        if (number % 2 == 1) scene.solver.max_time_step = 4e-3;
        scale(scene, size);
        const Rolled rolled = roll(scene, size, 48, Vec3(speed, 0, 0), 0.2, 0.2);
        const std::string name =
            fmt::format("{} on rails of a {}, {} m/s, size {}", wheel.name, rail.name, speed, size);
        EXPECT_LT(rolled.change, 1e-4) << name;
        EXPECT_LT(rolled.across, 1e-4) << name;
        EXPECT_LT(rolled.hop, 1e-4) << name;
        max_change = std::max(max_change, rolled.change);
        max_hop = std::max(max_hop, rolled.hop);
      }
  test::record_margin("most_change_of_speed", max_change, "each below 1e-4");
  test::record_margin("most_hop_over_radius", max_hop, "each below 1e-4");
}

// A wheel that reaches over the sides of two tables loses no more at the gap between them than a wheel that
// lies on them with its whole length: its axis turns about the second edge, which acts as a slope of gap / (2
// R). A wheel that flies over a part of the gap meets that edge in one step or in none, so the two may differ
// by what the fall of one step, g dt, gives along the slope.
TEST(EverydayRigidOverhang, GapsCostWideWheelsNoMoreThanNarrowOnes) {
  double most = 0;
  test::Cases cases(4);  // 5 of 18
  for (const ShapeKind kind : {ShapeKind::cylinder, ShapeKind::capsule})
    for (const double gap : {0.001, 0.005, 0.02})
      for (const double speed : {0.5, 1.0, 2.0}) {
        if (!cases.takes()) continue;
        double end[2];
        for (const bool reaches_over : {false, true}) {
          const Case wheel{"wheel", {.kind = kind, .radius = 0.2, .length = reaches_over ? 1.2 : 0.4}};
          scene::Scene scene =
              on_rails(wheel, {"table", {.kind = ShapeKind::box, .size = Vec3(4, 0.1, 0.5)}}, speed);
          scene.rigid[0].placement.position.x() = -0.5;
          scene.rigid[1].placement.position = Vec3(-2, -0.05, 0);
          scene.rigid[2].placement.position = Vec3(2 + gap, -0.05, 0);
          Simulation simulation(scene, test::plan(scene));
          const auto& rigid = simulation.world().bodies.rigid;
          const auto b = test::index_of_shape(simulation.world().bodies);
          for (int frame = 0; frame < 36; ++frame) simulation.advance_frame();
          end[reaches_over ? 1 : 0] = rigid.state[b].velocity.x();
        }
        EXPECT_GT(end[0], 0.9 * speed);
        const double one_step = 9.8 / 72 * gap / (2 * 0.2);
        EXPECT_NEAR(end[1], end[0], 2e-3 * speed + one_step) << "gap " << gap << ", " << speed << " m/s";
        most = std::max(most, (std::abs(end[1] - end[0]) - one_step) / speed);
      }
  test::record_margin("most_difference_but_for_a_step", most, "each below 2e-3");
}

// Points of a flat body's lower face that come from beside a rail, level with its top, must slide over it.
// When they were taken to hit the rail's side, which ends at that height, they stopped bodies without
// friction.
TEST(EverydayRigidOverhang, FlatBodiesSlideAlongRails) {
  double most = 0;
  test::Cases cases(5);  // 15 of 72
  for (const auto& [name, shape] : std::vector<std::pair<std::string, scene::Shape>>{
           {"box", {.kind = ShapeKind::box, .size = Vec3(0.9, 0.3, 0.9)}},
           {"upright cylinder", {.kind = ShapeKind::cylinder, .radius = 0.4, .length = 0.3}}})
    for (const double turn : {0.0, 0.35, 0.785})
      for (const double speed : {1.0, 5.0})
        for (const double friction : {0.0, 0.2})
          for (const double size : {0.02, 1.0, 20.0}) {
            if (!cases.takes()) continue;
            scene::Scene scene = on_rails({name, shape}, rails()[0], speed);
            scene::RigidBody& body = scene.rigid[0];
            body.placement.position = Vec3(0, 0.15, 0.02);
            body.placement.orientation = exponential(Vec3(0, turn, 0));
            body.placement.angular_velocity.setZero();
            for (scene::RigidBody& each : scene.rigid) each.friction = friction;
            scale(scene, size);
            Simulation simulation(scene, test::plan(scene));
            const auto& rigid = simulation.world().bodies.rigid;
            const auto b = test::index_of_shape(simulation.world().bodies);
            for (int frame = 0; frame < 10; ++frame) simulation.advance_frame();
            const double expected = speed - friction * 9.8 * 10 / 24;
            const double off = (rigid.state[b].velocity / size - Vec3(expected, 0, 0)).norm() / speed;
            // The points that carry the body change as it slides. On a single corner, friction turns it.
            EXPECT_LT(off, friction == 0 ? 2e-3 : 0.05) << name << " turned by " << turn << ", " << speed
                                                        << " m/s, friction " << friction << ", size " << size;
            if (friction == 0) most = std::max(most, off);
          }
  test::record_margin("most_lost_without_friction", most, "each below 2e-3");
}

// Without friction nothing may change how flat bodies slide and slowly turn on rails. When points that come
// from beside a rail, level with its top, struck its side, a box kept a tenth of its speed and turned back. A
// ring lost a tenth of its speed in a second to the samples of the rails' edges, which must be no bumps for
// it.
TEST(EverydayRigidOverhang, FlatBodiesTurnAsTheySlideAlongRails) {
  struct Turning {
    std::string name;
    scene::Shape shape;
    double fastest;  // rad/s
  };
  double max_change = 0, max_hop = 0;
  test::Cases cases(11);
  for (const auto& [name, shape, fastest] : std::vector<Turning>{
           {"box", {.kind = ShapeKind::box, .size = Vec3(1, 0.2, 1)}, 2},
           {"long box", {.kind = ShapeKind::box, .size = Vec3(1, 0.2, 0.8)}, 1},
           {"narrow box", {.kind = ShapeKind::box, .size = Vec3(0.5, 0.2, 1)}, 2},
           {"upright cylinder", {.kind = ShapeKind::cylinder, .radius = 0.5, .length = 0.2}, 1},
           {"ring", {.kind = ShapeKind::torus, .radius = 0.4, .tube = 0.1}, 2}})
    for (const Case& rail : {rails()[0], rails()[2]})
      for (const double spin : {0.0, 0.5, 1.0, 2.0})
        for (const double speed : {0.0, 0.3, 1.0})
          for (const double size : {1.0, 0.01, 20.0}) {
            // Building the grid of a mesh takes longer than the motion, so meshes run in few cases.
            if (spin > fastest || (rail.name == "mesh" && (size != 1 || speed == 0.3))) continue;
            if (!cases.takes()) continue;
            scene::Scene scene = on_rails({name, shape}, rail, speed);
            scene::RigidBody& body = scene.rigid[0];
            body.placement.position = Vec3(0, 0.1, 0.02);
            body.placement.orientation.setIdentity();
            body.placement.angular_velocity = Vec3(0, spin, 0);
            for (scene::RigidBody& each : scene.rigid) each.friction = 0;
            scale(scene, size);
            Simulation simulation(scene, test::plan(scene));
            const auto& rigid = simulation.world().bodies.rigid;
            const auto b = test::index_of_shape(simulation.world().bodies);
            double change = 0, hop = 0;
            // A narrow box that has turned by more than a radian falls between the rails.
            const int frames = spin > 1 ? static_cast<int>(24 / spin) : 24;
            for (int frame = 0; frame < frames; ++frame) {
              simulation.advance_frame();
              const RigidState& state = rigid.state[b];
              change = std::max({change, (state.velocity / size - Vec3(speed, 0, 0)).norm(),
                                 0.5 * (state.angular_velocity - Vec3(0, spin, 0)).norm()});
              hop = std::max(hop, std::abs(state.pose.position.y() / size - 0.1));
            }
            const std::string what =
                fmt::format("{} on {}, {} m/s, {} rad/s, size {}", name, rail.name, speed, spin, size);
            EXPECT_LT(change, 2e-2) << what;
            EXPECT_LT(hop, 2e-4) << what;
            max_change = std::max(max_change, change);
            max_hop = std::max(max_hop, hop);
          }
  test::record_margin("most_change_of_speed", max_change, "m/s, each below 2e-2");
  test::record_margin("most_hop_m", max_hop, "each below 2e-4");
}

// A body with its center of mass over the table by a hundredth of its width stands, and one with it beyond
// the edge by as much falls. The tables are two to 1000 times as wide as the body, so that samples of neither
// need be near the places where the body's edges leave the table.
TEST(EverydayRigidOverhang, SmallBodiesStandUpToTheTippingPoint) {
  double max_moved = 0;
  auto mesh = std::make_shared<TriangleMesh>(test::box_mesh(-Vec3(0.5, 0.5, 0.5), Vec3(0.5, 0.5, 0.5)));
  std::vector<std::pair<std::string, scene::Shape>> bodies{
      {"box", {.kind = ShapeKind::box, .size = Vec3(1, 1, 1)}},
      {"can", {.kind = ShapeKind::cylinder, .radius = 0.5, .length = 1}},
      {"ring", {.kind = ShapeKind::torus, .radius = 0.4, .tube = 0.1}},
      {"mesh", {.kind = ShapeKind::mesh, .scale = 1}}};
  bodies[3].second.mesh = mesh;
  test::Cases cases(5);  // 15 of 72
  for (const auto& [name, shape] : bodies)
    for (const double turn : {0.0, 0.17, 0.785})
      for (const double table : {2.0, 17.0, 1000.0})
        for (const double beyond : {-0.01, 0.01}) {
          if (!cases.takes()) continue;
          scene::Scene scene;
          scene.gravity = Vec3(0, -9.8, 0);
          scene::RigidBody body;
          body.name = "body";
          body.shape = shape;
          body.density = 1000;
          body.friction = 0.5;
          body.placement.position = Vec3(beyond, shape.kind == ShapeKind::torus ? 0.1 : 0.5, 0.213);
          body.placement.orientation = exponential(Vec3(0, turn, 0));
          scene.rigid.push_back(body);
          scene::RigidBody host;
          host.name = "table";
          host.shape = {.kind = ShapeKind::box, .size = Vec3(table, 0.5, table)};
          host.is_static = true;
          host.friction = 0.5;
          host.placement.position = Vec3(-table / 2, -0.25, 0);
          scene.rigid.push_back(host);
          Simulation simulation(scene, test::plan(scene));
          const auto b = test::index_of_shape(simulation.world().bodies);
          const RigidState& state = simulation.world().bodies.rigid.state[b];
          const Vec3 start = state.pose.position;
          for (int frame = 0; frame < 60; ++frame) simulation.advance_frame();
          const double moved = (state.pose.position - start).norm();
          const std::string what = fmt::format("{} turned by {}, {} beyond the edge of a table of {} m", name,
                                               turn, beyond, table);
          if (beyond > 0) {
            EXPECT_GT(moved, 0.3) << what;
          } else {
            EXPECT_LT(moved, 1e-4) << what;
            max_moved = std::max(max_moved, moved);
          }
        }
  test::record_margin("most_moved_over_width", max_moved, "each below 1e-4");
}

// A slab rolls on light logs, which are shorter or longer than it is wide, and up to 8500 times lighter. When
// shock propagation took the light bodies below heavy ones as fixed, they dragged and braked the slab.
TEST(EverydayRigidOverhang, SlabsRollOnLogs) {
  double max_change = 0, max_hop = 0;
  test::Cases cases(5);  // 5 of 24
  for (const ShapeKind kind : {ShapeKind::cylinder, ShapeKind::capsule})
    for (const double length : {0.8, 1.2})
      for (const double density : {100.0, 3000.0, 50000.0})
        for (const double speed : {0.3, 1.0}) {
          if (!cases.takes()) continue;
          scene::Scene scene;
          scene.gravity = Vec3(0, -9.8, 0);
          scene.ground = scene::Ground{.friction = 0.5, .restitution = 0, .look = {}};
          scene::RigidBody slab;
          slab.name = "body";
          slab.shape = {.kind = ShapeKind::box, .size = Vec3(3, 0.2, 1)};
          slab.density = density;
          slab.friction = 0.5;
          slab.placement.position = Vec3(0, 0.2, 0);
          slab.placement.velocity = Vec3(speed, 0, 0);
          scene.rigid.push_back(slab);
          for (const double x : {-1.2, -0.4, 0.4, 1.2}) {
            scene::RigidBody log;
            log.name = fmt::format("log{}", x);
            log.shape = {.kind = kind, .radius = 0.05, .length = length};
            log.density = 400;
            log.friction = 0.5;
            log.placement.position = Vec3(x, 0.05, 0);
            log.placement.orientation = exponential(Vec3(EIGEN_PI / 2, 0, 0));
            log.placement.velocity = Vec3(speed / 2, 0, 0);
            log.placement.angular_velocity = Vec3(0, 0, -speed / 2 / 0.05);
            scene.rigid.push_back(log);
          }
          const Rolled rolled = roll(scene, 1, 30, Vec3(speed, 0, 0), 0.2, 0.05);
          const std::string name = fmt::format("{} m logs, density {}, {} m/s", length, density, speed);
          EXPECT_LT(rolled.change, 1e-3) << name;
          // The bound is 3 % of g / 48 s, the fall of a step: what a thousandfold load leaves of it where
          // shock propagation is not in use.
          EXPECT_LT(rolled.across * speed, 0.03 * 9.8 / 48) << name;
          EXPECT_LT(rolled.hop, 1e-3) << name;
          max_change = std::max(max_change, rolled.change);
          max_hop = std::max(max_hop, rolled.hop);
        }
  test::record_margin("most_change_of_speed", max_change, "each below 1e-3");
  test::record_margin("most_hop_over_radius", max_hop, "each below 1e-3");
}

// A ring falls over a peg that stands on the ground, so that two static bodies adjoin. When the ground was
// taken for the continuation of the peg's top, the far side of the ring, deep below that top, was pushed up
// to it by 0.4 m between two frames. Such an error shows as a gain of energy.
TEST(EverydayRigidOverhang, ARingFallsOverAPegOnTheGround) {
  double max_gain = 0;
  for (const ShapeKind kind : {ShapeKind::cylinder, ShapeKind::box})
    for (const double beside : {0.05, 0.15, 0.25, 0.35})
      for (const double tilt : {0.0, 0.3, 0.9, 1.5}) {
        scene::Scene scene;
        scene.gravity = Vec3(0, -9.8, 0);
        scene.ground = scene::Ground{.friction = 0.5, .restitution = 0, .look = {}};
        scene::RigidBody peg;
        peg.name = "peg";
        peg.shape = {.kind = kind, .radius = 0.18, .size = Vec3(0.3, 1.6, 0.3), .length = 1.6};
        peg.is_static = true;
        peg.friction = 0.5;
        peg.placement.position = Vec3(0, 0.8, 0);
        scene.rigid.push_back(peg);
        scene::RigidBody ring;
        ring.name = "ring";
        ring.shape = {.kind = ShapeKind::torus, .radius = 0.31, .tube = 0.09};
        ring.density = 500;
        ring.friction = 0.5;
        ring.placement.position = Vec3(beside, 2.2, 0.03);
        ring.placement.orientation = exponential(Vec3(0.2, 0, tilt));
        scene.rigid.push_back(ring);
        Simulation simulation(scene, test::plan(scene));
        const FrameStats start = simulation.stats();
        const double scale = start.kinetic + start.potential;
        double least = scale, gain = 0;
        for (int frame = 0; frame < 48; ++frame) {
          simulation.advance_frame();
          const FrameStats stats = simulation.stats();
          gain = std::max(gain, (stats.kinetic + stats.potential - least) / scale);
          least = std::min(least, stats.kinetic + stats.potential);
        }
        EXPECT_LT(gain, 2e-3) << "peg of kind " << static_cast<int>(kind) << ", " << beside
                              << " m beside it, tilted by " << tilt;
        max_gain = std::max(max_gain, gain);
      }
  test::record_margin("most_gain", max_gain, "each below 2e-3");
}

}  // namespace
}  // namespace duet::everyday_rigid_overhang_test
