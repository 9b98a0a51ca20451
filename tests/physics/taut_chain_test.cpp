// Chains of joints that are as long as the distance of their ends: nothing in them can leave the line.
#include <algorithm>
#include <cmath>

#include "tests/support/articulated.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::taut_chain_test {
namespace {

constexpr double length = 0.25;  // m, of a plank

// Adds a bridge of planks from `anchor` (m) along `along`, a horizontal unit vector, between two pins of the
// body `end`. Its middle hangs `sag` (m) below the line.
void add_bridge(scene::Scene& scene, std::string_view end, scene::JointType type, int planks,
                const Vec3& anchor, const Vec3& along, double sag = 0) {
  const auto pin = [&](int i) {
    const double x = 2.0 * i / planks - 1;
    return Vec3(anchor + length * i * along - sag * (1 - x * x) * Vec3::UnitY());
  };
  for (int i = 0; i < planks; ++i) {
    scene::RigidBody& plank =
        test::add_box(scene, fmt::format("plank{}", i), (pin(i) + pin(i + 1)) / 2, Vec3(0.22, 0.05, 0.8), 2);
    plank.restitution = 0;
    plank.placement.orientation = shortest_rotation(Vec3::UnitX(), along);
  }
  for (int i = 0; i <= planks; ++i)
    test::add_joint(scene, type, i == 0 ? std::string(end) : fmt::format("plank{}", i - 1),
                    i == planks ? std::string(end) : fmt::format("plank{}", i), pin(i),
                    along.cross(Vec3::UnitY()));
}

// Returns a bridge over nothing.
scene::Scene bridge(scene::JointType type, int planks, const Vec3& along, double sag = 0) {
  scene::Scene scene = test::on_ground();
  scene.ground->height = -10;
  add_bridge(scene, "ground", type, planks, Vec3::Zero(), along, sag);
  return scene;
}

int count_taut(const scene::Scene& scene) {
  const Simulation simulation(scene, test::plan(scene));
  const std::vector<Joint>& joints = simulation.world().bodies.articulation.joints;
  return static_cast<int>(
      std::count_if(joints.begin(), joints.end(), [](const Joint& joint) { return joint.is_taut(); }));
}

// A ball of 10 kg that falls onto a straight bridge comes to rest on it, in steps as long as those of its
// fall, and the bridge does not move. Velocities across the line were free to first order and grew by g t,
// while all places stayed: 653 J after a second, in 7236 steps a frame.
TEST(TautChain, ABridgeCarriesABall) {
  for (const scene::JointType type : {scene::JointType::hinge, scene::JointType::point})
    for (const int planks : {2, 5})
      for (const Vec3& along : {Vec3(1, 0, 0), Vec3(0.8, 0, 0.6)}) {
        scene::Scene scene = bridge(type, planks, along);
        test::add_ball(scene, "ball", Vec3(1.2 * length * along + 0.6 * Vec3::UnitY()), 0.2, 10).restitution =
            0;
        Simulation simulation(scene, test::plan(scene));
        int substeps = 0;
        for (int frame = 0; frame < 24; ++frame) {
          simulation.advance_frame();
          substeps += simulation.stats().substeps;
        }
        const RigidBodies& rigid = simulation.world().bodies.rigid;
        double fastest = 0;
        for (std::size_t i = 0; i + 1 < rigid.size(); ++i)
          fastest = std::max(fastest, rigid.state[i].velocity.norm());
        const double height = rigid.state[as_index(planks)].pose.position.y();
        const std::string of = fmt::format(" of {} planks", planks);
        test::expect_below(fastest, 1e-6, "speed" + of + ", m/s");
        test::expect_below(std::abs(height - 0.225), 1e-5, "sinking of the ball" + of + ", m");
        test::expect_below(substeps / 24.0, 6, "steps a frame" + of);
      }
}

// Returns a frame that spins in free flight, with a chain between two of its places.
scene::Scene spinning_frame(scene::JointType type) {
  scene::Scene scene = test::free_space();
  test::add_box(scene, "frame", Vec3(0.5, -0.5, 0), Vec3(1.2, 0.1, 0.2), 20);
  add_bridge(scene, "frame", type, 4, Vec3::Zero(), Vec3::UnitX());
  const Vec3 spin(0.7, -1.1, 2.3);
  for (scene::RigidBody& body : scene.rigid) {
    body.placement.angular_velocity = spin;
    body.placement.velocity = Vec3(0.3, 0, 0.2) + spin.cross(body.placement.position);
  }
  return scene;
}

// A taut chain in a spinning frame keeps momentum, angular momentum and its place, and moves as if welded.
TEST(TautChain, AChainInASpinningFrameStaysStraight) {
  const scene::Scene scene = spinning_frame(scene::JointType::hinge);
  Simulation welded(spinning_frame(scene::JointType::weld), test::plan(scene));
  for (int frame = 0; frame < 24; ++frame) welded.advance_frame();
  Simulation simulation(scene, test::plan(scene));
  const FrameStats before = simulation.stats();
  for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
  const FrameStats after = simulation.stats();
  const RigidBodies& rigid = simulation.world().bodies.rigid;
  double moved = 0;
  for (std::size_t i = 1; i < rigid.size(); ++i)
    moved = std::max(moved, (rigid.state[0].pose.to_body(rigid.state[i].pose.position) -
                             (scene.rigid[i].placement.position - scene.rigid[0].placement.position))
                                .norm());
  test::expect_below((after.momentum - before.momentum).norm(), 1e-10, "linear momentum, kg m/s");
  test::expect_below((after.angular_momentum - before.angular_momentum).norm(), 1e-9,
                     "angular momentum, kg m^2/s");
  test::expect_below(std::abs(after.kinetic / welded.stats().kinetic - 1), 1e-9, "energy, relative to welds");
  test::expect_below(moved, 1e-7, "place in the frame, m");
}

// Only a loop whose longest side is the sum of at least two others is taut: no chain that sags or hangs from
// one end, no door on three hinges, and no loop of four sides that lies flat.
TEST(TautChain, OnlyStraightChainsBetweenTwoEndsAreTaut) {
  const scene::JointType point = scene::JointType::point;
  EXPECT_EQ(count_taut(bridge(point, 3, Vec3::UnitX())), 4);
  EXPECT_EQ(count_taut(bridge(point, 3, Vec3(0.8, 0, 0.6))), 4);
  EXPECT_EQ(count_taut(bridge(point, 3, Vec3::UnitX(), 1e-3)), 0);
  scene::Scene hanging = bridge(point, 3, Vec3::UnitX());
  hanging.joints.pop_back();
  EXPECT_EQ(count_taut(hanging), 0);
  scene::Scene door = test::free_space();
  test::add_peg(door, "post", Vec3::Zero());
  test::add_box(door, "door", Vec3(1, 0, 0), Vec3(1, 1, 0.1), 5);
  for (const double height : {-0.5, 0.0, 0.5})
    test::add_joint(door, point, "post", "door", Vec3(0.5, height, 0)).name = fmt::format("at {}", height);
  EXPECT_EQ(count_taut(door), 0);
  scene::Scene loop = test::free_space();
  test::add_loop(loop, 4, point, Vec3::Zero());
  EXPECT_EQ(count_taut(loop), 0);
}

}  // namespace
}  // namespace duet::taut_chain_test
