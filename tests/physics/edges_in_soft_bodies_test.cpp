// Sharp and round features of rigid bodies that press into soft bodies: contact bears the load, not
// interpenetration resolution, and nothing enters between the points of contact.
#include <algorithm>
#include <cmath>

#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/meshes.h"
#include "tests/support/scenes.h"
#include <Eigen/LU>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/rotation.h"
#include "sim/deformable/forces/tet_strain.h"
#include "sim/geometry/queries/closest_points.h"
#include "sim/step/world.h"

namespace duet::edges_in_soft_bodies_test {
namespace {

// A ring of a mesh lies on a soft box, and interpenetration resolution must have nothing to do. Beside the
// ring's rims the level set's value grows by less than the distance along its gradient. If contact took the
// value for a distance, it would let the box in by a third of a millimeter in every step, and
// interpenetration resolution would push it out again, at 4 J a frame. Contact leaves only its tolerance.
TEST(EdgesInSoftBodies, AreBorneByContact) {
  const double mass = 2000;
  scene::Scene scene = test::on_ground(0.6);
  scene.fps = 24;
  test::add_soft_box(scene, "box", Vec3(0, 0.5, 0), Vec3(2, 1, 2), 4, 2e5).shape.cells =
      test::runs_in_full() ? Vec3i(8, 4, 8) : Vec3i(5, 3, 5);
  scene.materials[0].poisson_ratio = 0.3;
  scene.materials[0].damping = 0.05;
  scene::RigidBody& ring = test::add_mesh(scene, "ring", test::asset("ring.obj"), 0.3, mass);
  ring.friction = 0.6;
  ring.placement.position = Vec3(0, 1.17, 0);
  Simulation simulation(scene, test::plan(scene));
  simulation.keep_ledger();
  double most = 0;
  int told = 0;
  for (int frame = 1; frame <= 36; ++frame) {
    simulation.advance_frame();
    if (frame <= 20) continue;  // until it lies still
    const FrameStats stats = simulation.stats();
    ASSERT_GT(stats.contacts, 50);
    for (const LedgerStats& stage : stats.ledger)
      if (stage.name == name(Stage::push_out)) {
        most = std::max(most, std::abs(stage.stored) / stats.substeps);
        ++told;
      }
  }
  EXPECT_EQ(told, 16);
  test::expect_below(most / (mass * 9.8), 1e-6, "push-out's work in a step over the ring's weight, m");
}

// Returns how deep (m) the boundary of the deformable bodies is inside rigid body 0, measured on a lattice of
// every triangle.
double deepest_place(const Bodies& bodies) {
  constexpr int order = 32;
  const LevelSet& shape = bodies.rigid.properties[0].shape;
  double least = 0;
  for (const Triangle& t : bodies.triangles)
    for (int i = 0; i <= order; ++i)
      for (int j = 0; i + j <= order; ++j) {
        const Vec3 weight = Vec3(i, j, order - i - j) / order;
        Vec3 x = Vec3::Zero();
        for (std::size_t k = 0; k < 3; ++k)
          x += weight[static_cast<int>(k)] * bodies.particles.x[static_cast<std::size_t>(t[k])];
        least = std::min(least, shape.distance(bodies.rigid.state[0].pose.to_body(x)));
      }
  return -least;
}

// A block with cells of half a meter falls on the edge of a beam that crosses the block's edges askew. With
// contact at its points alone, which are 12 cm apart, the beam enters by 23 mm.
TEST(EdgesInSoftBodies, EnterNowhereBetweenPoints) {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -9.8, 0);
  auto& beam = test::add_box(scene, "beam", Vec3::Zero(), Vec3(1, 1, 5), 1);
  beam.is_static = true;
  beam.mass.reset();
  beam.placement.orientation =
      Quat(Eigen::AngleAxisd(0.4, Vec3::UnitY())) * Quat(Eigen::AngleAxisd(EIGEN_PI / 4, Vec3::UnitZ()));
  test::add_soft_box(scene, "block", Vec3(0.13, 1.27, 0.21), Vec3(2, 1, 2), 4, 2e5).shape.cells =
      Vec3i(4, 2, 4);
  Simulation simulation(scene, test::plan(scene));
  double deepest = 0;
  for (int frame = 1; frame <= 24; ++frame) {
    simulation.advance_frame();
    deepest = std::max(deepest, deepest_place(simulation.world().bodies));
  }
  EXPECT_GT(simulation.stats().contacts, 4);
  test::expect_below(deepest, 1e-3, "deepest place of the block's boundary, m");
}

// Returns how deep (m) the vertices of rigid body 0, a box, are inside the deformable bodies.
double deepest_corner(const Bodies& bodies) {
  const RigidProperties& box = bodies.rigid.properties[0];
  double deepest = 0;
  for (int k = 0; k < 8; ++k) {
    const Vec3 sign(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
    const Vec3 corner = bodies.rigid.state[0].pose.to_world(sign.cwiseProduct(box.shape.half));
    const auto x = [&](int p) { return bodies.particles.x[static_cast<std::size_t>(p)]; };
    if (std::none_of(bodies.tets.begin(), bodies.tets.end(), [&](const Tet& tet) {
          const Vec3 weight = edge_matrix(tet, bodies.particles.x).inverse() * (corner - x(tet[0]));
          return weight.minCoeff() >= 0 && weight.sum() <= 1;
        }))
      continue;
    double least = 1;
    for (const Triangle& t : bodies.triangles)
      least = std::min(least, closest_point_triangle({corner, x(t[0]), x(t[1]), x(t[2])}).difference.norm());
    deepest = std::max(deepest, least);
  }
  return deepest;
}

// A block falls on the upright vertex of a cube, which meets the middle of a face. With contact at the
// block's points alone the vertex enters by 77 mm.
TEST(EdgesInSoftBodies, EnterAtCornersNeither) {
  scene::Scene scene = test::free_space();
  scene.gravity = Vec3(0, -9.8, 0);
  auto& cube = test::add_box(scene, "cube", Vec3(0, -std::sqrt(0.75), 0), Vec3(1, 1, 1), 1);
  cube.is_static = true;
  cube.mass.reset();
  cube.placement.orientation = shortest_rotation(Vec3(1, 1, 1), Vec3::UnitY());
  test::add_soft_box(scene, "block", Vec3(0.17, 0.52, 0.29), Vec3(2, 1, 2), 4, 2e5).shape.cells =
      Vec3i(4, 2, 4);
  Simulation simulation(scene, test::plan(scene));
  double deepest = 0, corner = 0;
  for (int frame = 1; frame <= 12; ++frame) {  // later the block has fallen off
    simulation.advance_frame();
    deepest = std::max(deepest, deepest_place(simulation.world().bodies));
    corner = std::max(corner, deepest_corner(simulation.world().bodies));
  }
  test::expect_below(deepest, 1e-3, "deepest place of the block's boundary, m");
  test::expect_below(corner, 1e-3, "deepest corner of the cube, m");
}

// Returns how deep (m) the boundary of a falling block has been inside a static rigid body within ten frames.
// The body's highest point is the origin, and the middle of the block's bottom starts 2 cm above it,
// displaced by `beside` (m).
double deepest_under_block(const scene::RigidBody& body, const Vec3& beside) {
  scene::Scene scene = test::free_space();
  scene.fps = 24;
  scene.gravity = Vec3(0, -9.8, 0);
  scene.rigid.push_back(body);
  scene.rigid[0].is_static = true;
  scene.rigid[0].mass.reset();
  test::add_soft_box(scene, "block", Vec3(0, 0.52, 0) + beside, Vec3(2, 1, 2), 4, 2e5).shape.cells =
      Vec3i(4, 2, 4);
  scene.materials[0].damping = 0.01;
  Simulation simulation(scene, test::plan(scene));
  double deepest = 0;
  for (int frame = 1; frame <= 10; ++frame) {
    simulation.advance_frame();
    deepest = std::max(deepest, deepest_place(simulation.world().bodies));
  }
  EXPECT_GT(simulation.stats().contacts, 0);
  return deepest;
}

// A block falls on the round end of an upright spindle with a radius of 16 cm. With contact at the block's
// points alone the end enters by 25 mm. The bound of 3 mm is the height of the round end within the sample
// spacing of 6 cm.
TEST(EdgesInSoftBodies, EnterNowhereOnRoundEnds) {
  scene::Scene scene;
  scene::RigidBody& link = test::add_mesh(scene, "link", test::asset("lathe_link.obj"), 0.65, 1);
  link.sample_spacing = 0.06;
  link.placement.position = Vec3(0, -1.3, 0);
  link.placement.orientation = Quat(Eigen::AngleAxisd(EIGEN_PI / 2, Vec3::UnitZ()));
  test::expect_below(deepest_under_block(link, Vec3(0.17, 0.2, 0.29)), 3e-3,  // what 6 cm are deep there
                     "deepest place of the block's boundary, m");
}

// Returns a cylinder along y, with its dimensions in m.
scene::RigidBody cylinder(double radius, double height) {
  scene::RigidBody body;
  body.name = "cylinder";
  body.shape.kind = scene::ShapeKind::cylinder;
  body.shape.radius = radius;
  body.shape.length = height;
  return body;
}

// A block falls on the rim of a peg that leans by 45 degrees. With contact at points and edges alone the rim
// enters by 6.6 mm.
TEST(EdgesInSoftBodies, EnterNowhereOnRims) {
  scene::RigidBody peg = cylinder(1, 2);
  peg.placement.position = Vec3(0, -std::sqrt(2), 0);
  peg.placement.orientation = Quat(Eigen::AngleAxisd(EIGEN_PI / 4, Vec3::UnitZ()));
  test::expect_below(deepest_under_block(peg, Vec3(0.17, 0, 0.29)), 1e-3,
                     "deepest place of the block's boundary, m");
}

// A block falls on a marble of 10 cm below a face, an edge, a node and a diagonal of its mesh. With contact
// at points alone the marble enters by 3 to 7 mm.
TEST(EdgesInSoftBodies, EnterNowhereOnMarbles) {
  for (const Vec3& beside : {Vec3(0.17, 0, 0.29), Vec3(0.25, 0, 0), Vec3(0.25, 0, 0.25), Vec3(0.1, 0, 0.1)}) {
    scene::Scene scene;
    scene::RigidBody& marble = test::add_ball(scene, "marble", Vec3(0, -0.05, 0), 0.05, 1);
    test::expect_below(deepest_under_block(marble, beside), 1e-3, "deepest place of the block's boundary, m");
  }
}

// Returns a soft box of 1 m that stands on the ground.
scene::Scene soft_box_on_ground() {
  scene::Scene scene = test::on_ground(0.5);
  scene.fps = 24;
  scene.solver.cg_tolerance = 1e-8;  // the default tolerance leaves a residual of 2 mm/s
  test::add_soft_box(scene, "soft", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 3);
  scene.materials[0].damping = 0.05;
  return scene;
}

// Returns the largest speed (m/s) of a particle within the third second.
double fastest_in_third_second(Simulation& simulation) {
  for (int frame = 1; frame <= 48; ++frame) simulation.advance_frame();
  double speed = 0;
  for (int frame = 1; frame <= 24; ++frame) {
    simulation.advance_frame();
    for (const Vec3& v : simulation.world().bodies.particles.v) speed = std::max(speed, v.norm());
  }
  return speed;
}

// A rigid box lies on a wider soft one, whose edges stick out under the rims of the rigid one. They touch
// there in every step, both lying flat along the bottom and bent up. If these contacts come and go, the soft
// box keeps trembling at 16 mm/s. The bound is what the sweeps of the contact solve leave: with tolerances of
// 1e-6 to 1e-8 m/s and 20 or 100 sweeps it was 0.7e-5 to 1e-4 m/s in all but one of twelve measurements of
// half a second. With three sweeps of the projection, conjugate gradients find residuals that only violate
// constraints, and would diverge: particles had up to 58 m/s.
TEST(EdgesInSoftBodies, LieStillUnderRims) {
  for (const int sweeps : {4, 3}) {
    scene::Scene scene = soft_box_on_ground();
    scene.solver.projection_iterations = sweeps;
    test::add_box(scene, "rigid", Vec3(0, 1.2, 0), Vec3(0.8, 0.4, 0.8), 1500).friction = 0.5;
    Simulation simulation(scene, test::plan(scene));
    const double speed = fastest_in_third_second(simulation);
    test::expect_below(speed, 1e-4, fmt::format("fastest particle with {} sweeps, m/s", sweeps));
  }
}

// A cylinder stands upright on the soft box. Which place of its rim is the support point of a face hardly
// differs in depth along the rim. If the contact were left out where that difference is next to nothing, it
// would come and go, and the box would keep trembling at 0.6 to 2 mm/s.
TEST(EdgesInSoftBodies, StandStillUnderCylinders) {
  scene::Scene scene = soft_box_on_ground();
  scene.rigid.push_back(cylinder(0.35, 0.6));
  scene.rigid[0].placement.position = Vec3(0.02, 1.3, 0.01);
  scene.rigid[0].mass = 1500;
  scene.rigid[0].friction = 0.5;
  Simulation simulation(scene, test::plan(scene));
  const double speed = fastest_in_third_second(simulation);
  test::expect_below(speed, 5e-5, "fastest particle, m/s");
  test::expect_below(deepest_place(simulation.world().bodies), 1e-4,
                     "deepest place of the box's boundary, m");
}

}  // namespace
}  // namespace duet::edges_in_soft_bodies_test
